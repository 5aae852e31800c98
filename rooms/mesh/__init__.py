"""Rooms made of polygons: geometry, visibility and specular paths."""

from rooms.mesh.geometry import MeshGeometry
from rooms.mesh.images import Paths, find_paths

__all__ = ["MeshGeometry", "Paths", "find_paths"]
