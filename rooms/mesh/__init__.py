"""Rooms of any polygon shape."""

from rooms.mesh.shape import Mesh

__all__ = ["Mesh"]
