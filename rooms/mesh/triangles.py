"""Triangles that bound a room, and what compiled loops and tests ask of them."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir.errors import SceneError
from rooms.mesh.cleaning import winding
from rooms.mesh.hierarchy import Hierarchy, build_hierarchy
from rooms.mesh.hits import free_ways
from rooms.mesh.nearness import distances, lift_off
from rooms.mesh.pairing import pair_up
from rooms.mesh.panels import Panels
from rooms.mesh.shell import closed_shell, signed_volume

__all__ = ["Tables", "Triangles"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Tables:
    """What the compiled loops look up.

    Parameters
    ----------
    rims : ndarray, shape (F, 3, 4)
        Half-spaces within which a point of the plane lies in the triangle.
    planes : ndarray, shape (F, 4)
        Normal and offset of each triangle.
    blockers : ndarray, shape (B,)
        Triangles that can stand between two points of the room.
    """

    rims: FloatArray
    planes: FloatArray
    blockers: IntArray


@dataclass(frozen=True, eq=False)
class Triangles:
    """Cleaned triangles, with coplanar ones merged to panels.

    Parameters
    ----------
    vertices, faces : ndarray, shape (V, 3), (F, 3)
        Corners relative to `origin` [m] and vertex indices.
    face_surface : ndarray, shape (F,)
        Surface (row of materials) of each triangle.
    surface_names : tuple of str
        Name of each surface.
    panels : Panels
        Merged coplanar triangles.
    origin : ndarray, shape (3,)
        Middle of the mesh [m]; keeps precision far from the zero point.
    tolerance : float
        Distance within which points count as one [m].
    watertight : bool
        Whether the triangles enclose the air.
    report : tuple of str
        What was repaired, and what was left open.
    """

    vertices: FloatArray
    faces: IntArray
    face_surface: IntArray
    surface_names: tuple[str, ...]
    panels: Panels
    origin: FloatArray
    tolerance: float
    watertight: bool
    report: tuple[str, ...] = field(default=())

    @cached_property
    def corners(self) -> FloatArray:
        """Corners of each triangle relative to `origin`, shape (F, 3, 3)."""
        return np.ascontiguousarray(self.vertices[self.faces])

    @cached_property
    def face_areas(self) -> FloatArray:
        """Area of each triangle [m²], shape (F,)."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2

    @property
    def surfaces(self) -> int:
        """Number of surfaces with a material of their own."""
        return len(self.surface_names)

    @property
    def areas(self) -> FloatArray:
        """Area of each surface [m²], shape (surfaces,)."""
        areas = np.zeros(self.surfaces)
        np.add.at(areas, self.face_surface, self.face_areas)
        return areas

    @property
    def volume(self) -> float:
        """Volume of the air [m³]; of the convex hull when the mesh has no shell."""
        return self._volume

    @cached_property
    def _volume(self) -> float:
        if not self.watertight and len(self.shell):
            return abs(signed_volume(self.corners[self.shell]))
        if not self.watertight:
            from scipy.spatial import ConvexHull, QhullError

            try:
                return float(ConvexHull(self.vertices).volume)
            except QhullError:
                return 0.0
        return abs(signed_volume(self.corners))

    @cached_property
    def shell(self) -> IntArray:
        """Triangles that enclose the air; see `rooms.mesh.shell.closed_shell`."""
        if self.watertight:
            return np.arange(len(self.faces))
        return closed_shell(self.vertices, self.faces)

    @property
    def center(self) -> FloatArray:
        """Middle of the mesh [m], shape (3,)."""
        return self.origin

    @property
    def size(self) -> FloatArray:
        """Lengths of the bounding box [m], shape (3,)."""
        return np.ptp(self.vertices, axis=0)

    @property
    def diagonal(self) -> float:
        """Length of the diagonal of the bounding box [m]."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0)))

    @cached_property
    def occluders(self) -> IntArray:
        """Panels that can stand between two points of the room."""
        height = self.panels.normal @ self.vertices.T - self.panels.offset[:, None]
        slack = 2 * self.tolerance
        return np.nonzero((height.min(1) < -slack) & (height.max(1) > slack))[0]

    @cached_property
    def tables(self) -> Tables:
        """What the compiled loops look up."""
        corners = self.corners
        sides = np.roll(corners, -1, axis=1) - corners
        normal = np.cross(sides[:, 0], sides[:, 1])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        inward = np.cross(normal[:, None], sides)
        inward /= np.linalg.norm(inward, axis=2, keepdims=True)
        rim = np.einsum("fsk,fsk->fs", inward, corners)
        offset = np.einsum("fk,fk->f", normal, corners[:, 0])
        blocking = np.isin(self.panels.of_face, self.occluders)
        return Tables(
            np.ascontiguousarray(np.concatenate([inward, rim[:, :, None]], axis=2)),
            np.column_stack([normal, offset]),
            np.nonzero(blocking)[0],
        )

    @cached_property
    def pairs(self) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Triangles joined to parallelograms where two make one; see `pair_up`."""
        kind = self.panels.of_face * self.surfaces + self.face_surface
        return pair_up(self.vertices, self.faces, kind, 1e-9 * self.diagonal)

    @cached_property
    def hierarchy(self) -> Hierarchy:
        """Tree of boxes around the triangles."""
        return build_hierarchy(*self.pairs, 2e-6 * self.diagonal)

    def sees(self, point: FloatArray, others: FloatArray) -> NDArray[np.bool_]:
        """Tell which points, shape (N, 3), are in free sight of one; all local."""
        starts = np.broadcast_to(point, others.shape).copy()
        tree, panel = self.hierarchy.arrays, self.panels.of_face
        return free_ways(tree, panel, starts, others, 1e-9 * self.diagonal)

    def visible(self, a: ArrayLike, b: ArrayLike) -> NDArray[np.bool_]:
        """Tell which of N segments from `a` to `b`, shape (N, 3), are free."""
        starts, ends = self.localised(a), self.localised(b)
        starts, ends = (part.copy() for part in np.broadcast_arrays(starts, ends))
        tree, panel = self.hierarchy.arrays, self.panels.of_face
        return free_ways(tree, panel, starts, ends, 1e-9 * self.diagonal)

    @property
    def convex(self) -> bool:
        """Whether every two points of the room see each other."""
        return self.watertight and len(self.occluders) == 0

    def localised(self, points: ArrayLike) -> FloatArray:
        """Return points, shape (N, 3), relative to `origin`, off the surfaces.

        A point on a surface has no side. It is moved into the air by a thousandth
        of `tolerance`, far less than any wavelength.
        """
        local = np.asarray(points, dtype=float).reshape(-1, 3) - self.origin
        if not np.all(np.isfinite(local)):
            raise SceneError(f"a position is not finite: {points}")
        return lift_off(self.corners, self.panels, self.tolerance * 1e-3, local)

    def outside(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Tell which points, shape (N, 3), lie neither in nor on the room.

        An open mesh without a closed shell has no outside; there, points beyond its
        bounding box are out.
        """
        local = np.asarray(points, dtype=float).reshape(-1, 3) - self.origin
        reach = np.abs(self.vertices).max(axis=0) + self.tolerance
        out = np.any(np.abs(local) > reach, axis=1)
        if len(self.shell):
            inner = np.nonzero(~out)[0]
            shell = self.corners[self.shell]
            out[inner] = np.abs(winding(shell, local[inner])) < 0.5
            doubtful = np.nonzero(out)[0]
            out[doubtful] = distances(self.corners, local[doubtful]) > self.tolerance
        return out
