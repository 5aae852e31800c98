"""Rooms of any shape: triangles, the planes they lie in, and convex faces."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir.errors import SceneError
from rooms.mesh.faces import convex_faces, label_planes
from rooms.mesh.repair import Repaired, repair

__all__ = ["Mesh"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Mesh:
    """A room of flat triangles, watertight or not.

    Parameters
    ----------
    vertices : array_like, shape (V, 3)
        Corners [m].
    triangles : array_like, shape (T, 3)
        Indices of corners. Their winding is put right where the mesh is closed.
    surface : array_like, shape (T,), optional
        Number of the material of each triangle; 0 when left out.

    Notes
    -----
    `remarks` says what was repaired or left open. Of a closed mesh the largest
    shell is the room and every other one an object in it; normals look into the
    air. An open mesh reflects on both sides of each triangle.
    """

    vertices: FloatArray
    triangles: IntArray
    surface: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    remarks: tuple[str, ...] = ()
    closed: bool = False

    def __post_init__(self) -> None:
        given = np.asarray(self.surface, dtype=np.int64)
        if not len(given):
            given = np.zeros(len(self.triangles), dtype=np.int64)
        fixed: Repaired = repair(self.vertices, self.triangles, given)
        for name in ("vertices", "triangles", "surface", "closed"):
            object.__setattr__(self, name, getattr(fixed, name))
        object.__setattr__(self, "remarks", (*self.remarks, *fixed.remarks))

    @cached_property
    def corners(self) -> FloatArray:
        """Corner positions of each triangle [m], shape (T, 3, 3)."""
        return np.ascontiguousarray(self.vertices[self.triangles])

    @cached_property
    def _crosses(self) -> FloatArray:
        a, b, c = np.swapaxes(self.corners, 0, 1)
        return np.cross(b - a, c - a)

    @cached_property
    def triangle_areas(self) -> FloatArray:
        """Area of each triangle [m²], shape (T,)."""
        return np.linalg.norm(self._crosses, axis=1) / 2

    @cached_property
    def normals(self) -> FloatArray:
        """Unit normal of each triangle, into the air if closed, shape (T, 3)."""
        return self._crosses / (2 * self.triangle_areas[:, None])

    @cached_property
    def areas(self) -> FloatArray:
        """Total area of each surface (material) [m²], shape (surfaces,)."""
        return np.bincount(
            self.surface, weights=self.triangle_areas, minlength=self.surfaces
        )

    @cached_property
    def surfaces(self) -> int:
        """Number of surfaces with a material of their own."""
        return int(self.surface.max()) + 1

    @cached_property
    def volume(self) -> float:
        """Volume of the air [m³]; of the bounding box if the mesh is open."""
        if not self.closed:
            return float(np.prod(np.maximum(np.ptp(self.vertices, axis=0), 1e-3)))
        a, b, c = np.swapaxes(self.corners - self.center, 0, 1)
        return float(abs(np.einsum("ij,ij->", a, np.cross(b, c)))) / 6

    @cached_property
    def center(self) -> FloatArray:
        """Middle of the bounding box [m], shape (3,)."""
        return (self.vertices.min(axis=0) + self.vertices.max(axis=0)) / 2

    @cached_property
    def size(self) -> FloatArray:
        """Lengths of the bounding box [m], shape (3,)."""
        return np.ptp(self.vertices, axis=0)

    @cached_property
    def plane(self) -> IntArray:
        """Number of the plane each triangle lies in, shape (T,)."""
        return label_planes(self.corners, self.normals, both_sides=not self.closed)

    @cached_property
    def faces(self) -> list[tuple[IntArray, int]]:
        """Convex polygons of coplanar triangles: (vertex numbers, a triangle)."""
        return convex_faces(self.vertices, self.triangles, self.plane, self.surface)

    @cached_property
    def convex(self) -> bool:
        """Whether every corner lies in front of (or on) every triangle."""
        if not self.closed:
            return False
        first = np.unique(self.plane, return_index=True)[1]
        away = self.vertices @ self.normals[first].T
        level = np.einsum("ij,ij->i", self.corners[first, 0], self.normals[first])
        return bool(np.all(away - level > -1e-9 * np.linalg.norm(self.size)))

    def outside(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Tell which points, shape (N, 3), do not lie in the air.

        By the winding number (van Oosterom & Strackee, IEEE Trans. Biomed. Eng.
        30, 125 (1983)) if closed; by the bounding box if open. Points on a
        surface count as inside.
        """
        points = np.asarray(points, dtype=float)
        slack = 1e-9 * np.linalg.norm(self.size)
        middle, half = self.center, self.size / 2
        beyond = np.any(np.abs(points - middle) > half + slack, axis=-1)
        if not self.closed:
            return beyond
        return beyond | np.array([self._winding(point) > 0.25 for point in points])

    def _winding(self, point: FloatArray) -> float:
        """Return 1 minus the winding number seen from a point of the air."""
        a, b, c = np.swapaxes(self.corners - point, 0, 1)
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        top = np.einsum("ij,ij->i", a, np.cross(b, c))
        bottom = la * lb * lc + lc * np.einsum("ij,ij->i", a, b)
        bottom += la * np.einsum("ij,ij->i", b, c) + lb * np.einsum("ij,ij->i", a, c)
        flat = np.abs(top) < 1e-12 * np.maximum(la * lb * lc, 1e-300)
        angles = np.where(flat, 0.0, 2 * np.arctan2(top, bottom))
        if np.any(flat & (bottom <= 1e-12 * la * lb * lc)):
            return 0.0  # on a surface
        return 1.0 + float(angles.sum()) / (4 * np.pi)

    def require_faces(self) -> None:
        """Raise `SceneError` if nothing is left to reflect sound."""
        if not len(self.triangles):
            raise SceneError("the mesh has no triangle with an area")
