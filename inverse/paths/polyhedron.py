"""A room of flat faces whose planes can be moved: the shape of a mesh room."""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from rooms import Scene
    from rooms.mesh import MeshGeometry
from rir.arrays import FloatArray, IntArray

__all__ = ["Polyhedron", "tangents"]

LOOSE = 1e-6
"""Metres, and parts of a unit normal: rounding of meshes in single precision."""


@dataclass(frozen=True, eq=False)
class Polyhedron:
    """Hold planes and the triangles that lie in them."""

    planes: FloatArray
    """Unit normals into the air and offsets; n . x = d on the plane. Shape (P, 4)."""
    vertices: FloatArray
    """Corners, metres. Shape (V, 3)."""
    faces: IntArray
    """Triangles. Shape (F, 3)."""
    plane_of: IntArray
    """Plane of each triangle. Shape (F,)."""

    @classmethod
    def of_mesh(cls, mesh: "MeshGeometry", angle: float = 1e-3) -> "Polyhedron":
        """Take over a mesh; panels in one plane, facing one way, share it."""
        panels = mesh.panels
        rows = np.column_stack([panels.normal, panels.offset])
        merged, number = _merged(rows, _areas_of(mesh), angle, mesh.diagonal)
        merged = merged.copy()
        merged[:, 3] += merged[:, :3] @ mesh.origin
        return cls(
            merged, mesh.vertices + mesh.origin, mesh.faces, number[panels.of_face]
        )

    @classmethod
    def of_scene(cls, scene: "Scene") -> "Polyhedron":
        """Take over the shape of a scene, a box or a mesh."""
        from rooms.mesh import MeshGeometry

        shape = scene.geometry
        if not isinstance(shape, MeshGeometry):
            shape = MeshGeometry.box(shape.size)
        return cls.of_mesh(shape)

    @classmethod
    def load(cls, name: str) -> "Polyhedron":
        """Open a mesh, a room file or a built-in scene, as ``simulate-room`` does."""
        from rooms.builtin import load_scene

        return cls.of_scene(load_scene(name))

    @classmethod
    def of_triangles(cls, triangles: FloatArray) -> "Polyhedron":
        """Take over loose triangles, shape (F, 3, 3), turned into the air."""
        from rooms.mesh import MeshGeometry

        corners = np.asarray(triangles, dtype=np.float64).reshape(-1, 3)
        faces = np.arange(len(corners)).reshape(-1, 3)
        return cls.of_mesh(MeshGeometry.from_arrays(corners, faces))

    @cached_property
    def mesh(self) -> "MeshGeometry":
        """The room for the engine of mirror paths; surface k is plane k."""
        from rooms.mesh import MeshGeometry

        return MeshGeometry.from_arrays(self.vertices, self.faces, self.plane_of)

    @property
    def areas(self) -> FloatArray:
        """Area of the faces in each plane, shape (P,), square metres."""
        a, b, c = np.moveaxis(self.vertices[self.faces], 1, 0)
        size = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
        return _summed(self.plane_of, size, len(self.planes))

    def moved(self, planes: FloatArray) -> "Polyhedron":
        """Return the room with other planes; every corner follows its own.

        A corner of three planes or more is where they meet; one of fewer (a seam
        within a wall) moves the shortest way that keeps it in them.
        """
        vertices = self.vertices.copy()
        for corner, mine in enumerate(self._planes_at):
            if len(mine) == 0:
                continue
            rows = planes[mine]
            gap = rows[:, 3] - rows[:, :3] @ vertices[corner]
            vertices[corner] += np.linalg.lstsq(rows[:, :3], gap, rcond=LOOSE)[0]
        return replace(self, planes=planes.copy(), vertices=vertices)

    @cached_property
    def _planes_at(self) -> list[IntArray]:
        pairs = np.unique(
            np.column_stack([self.faces.ravel(), self.plane_of.repeat(3)]), axis=0
        )
        cuts = np.searchsorted(pairs[:, 0], np.arange(len(self.vertices) + 1))
        return [pairs[a:b, 1] for a, b in pairwise(cuts)]


def _areas_of(mesh: "MeshGeometry") -> FloatArray:
    return _summed(mesh.panels.of_face, mesh.face_areas, len(mesh.panels))


def _summed(number: IntArray, values: FloatArray, count: int) -> FloatArray:
    return np.bincount(number, values, minlength=count).astype(np.float64)


def _merged(
    rows: FloatArray, areas: FloatArray, angle: float, size: float
) -> tuple[FloatArray, IntArray]:
    """Merge rows of planes that are one plane, the largest panel's first."""
    number = np.full(len(rows), -1)
    kept: list[int] = []
    for row in np.argsort(-areas, kind="stable").tolist():
        if number[row] >= 0:
            continue
        along = rows[:, :3] @ rows[row, :3]
        same = (along > 1 - angle**2 / 2) & (
            np.abs(rows[:, 3] - rows[row, 3]) < angle * size / 2
        )
        number[same & (number < 0)] = len(kept)
        kept.append(row)
    return rows[kept], number


def tangents(normal: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return two unit vectors that make a frame with a normal."""
    axis = np.eye(3)[int(np.argmin(np.abs(normal)))]
    first = np.cross(normal, axis)
    first = np.asarray(first / np.linalg.norm(first), dtype=np.float64)
    return first, np.asarray(np.cross(normal, first), dtype=np.float64)
