"""Rooms bounded by triangles."""

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir.arrays import FloatArray, IntArray
from rir.errors import SceneError
from rir.numbers import read_number
from rooms.mesh.arrays import check_arrays, surface_ids
from rooms.mesh.cleaning import clean, winding
from rooms.mesh.hierarchy import Hierarchy, build_hierarchy
from rooms.mesh.hits import free_ways
from rooms.mesh.loading import load_mesh
from rooms.mesh.nearness import distances, lift_off
from rooms.mesh.pairing import pair_up
from rooms.mesh.panels import Panels, find_panels
from rooms.mesh.polygon import cut_ears
from rooms.mesh.reach import Reach, find_reach
from rooms.mesh.shell import closed_shell, hull_volume, repairs, signed_volume
from rooms.mesh.tables import Tables, make_tables

__all__ = ["MeshGeometry"]

_RELATIVE = 1e-6
"""Share of the diagonal within which points count as one."""


@dataclass(frozen=True, eq=False)
class MeshGeometry:
    """A room made of triangles, cleaned, with coplanar triangles merged.

    Build one by `from_file`, `from_arrays`, `extruded` or `box`.

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

    Examples
    --------
    >>> room = MeshGeometry.box((6, 5, 3))
    >>> room.volume, len(room.panels), room.watertight
    (90.0, 6, True)
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

    @staticmethod
    def from_arrays(
        vertices: ArrayLike,
        faces: ArrayLike,
        surfaces: Any = None,
        *,
        resolution: float = 0.0,
    ) -> "MeshGeometry":
        """Build a room from triangles.

        Parameters
        ----------
        vertices : array_like, shape (V, 3)
            Corners [m].
        faces : array_like, shape (F, 3)
            Vertex indices; any winding.
        surfaces : sequence of int or str, shape (F,), optional
            Surface of each triangle; one surface "all" when left out.
        resolution : float
            Step of the stored coordinates [m], if coarser than double precision.

        Raises
        ------
        SceneError
            If the arrays describe no triangles.
        """
        corners, triangles = check_arrays(vertices, faces)
        names, ids = surface_ids(surfaces, len(triangles))
        used = np.unique(triangles)
        low, high = corners[used].min(axis=0), corners[used].max(axis=0)
        origin = (low + high) / 2
        diagonal = float(np.linalg.norm(high - low))
        tolerance = max(_RELATIVE * diagonal, resolution)
        mesh = clean(
            corners[used] - origin, np.searchsorted(used, triangles), tolerance
        )
        panels = find_panels(mesh.vertices, mesh.faces, tolerance, mesh.watertight)
        return MeshGeometry(
            mesh.vertices,
            mesh.faces,
            ids[mesh.kept],
            names,
            panels,
            origin,
            tolerance,
            mesh.watertight,
            repairs(mesh, len(panels)),
        )

    @staticmethod
    def from_file(
        path: str | Path, *, up: str = "z", scale: float = 1.0
    ) -> "MeshGeometry":
        """Read a room from an OBJ, PLY, GLB or STL file; see `load_mesh`.

        Parameters
        ----------
        path : str or Path
            The file.
        up : {"z", "y"}
            Axis of the file that points up; the room's z.
        scale : float
            Length of the file's unit [m].
        """
        if up not in ("y", "z"):
            raise SceneError(f"'z' or 'y' points up in a mesh file, not {up!r}")
        mesh = load_mesh(path)
        step = read_number(scale, "the scale of a mesh [m]", above=0, error=SceneError)
        vertices = step * mesh.vertices
        if up == "y":
            vertices = vertices[:, [0, 2, 1]] * [1, -1, 1]
        return MeshGeometry.from_arrays(
            vertices, mesh.faces, mesh.names, resolution=step * mesh.resolution
        )

    @staticmethod
    def extruded(polygon: ArrayLike, height: float) -> "MeshGeometry":
        """Build a room with vertical walls on a simple polygon.

        Parameters
        ----------
        polygon : array_like, shape (n, 2)
            Corners of the floor [m], in order.
        height : float
            Height of the ceiling [m].

        Raises
        ------
        SceneError
            If the polygon has no area or crosses itself, or the height is not positive.

        Examples
        --------
        >>> lot = [(0, 0), (6, 0), (6, 2.5), (3, 2.5), (3, 5), (0, 5)]
        >>> MeshGeometry.extruded(lot, 3).surface_names
        ('floor', 'ceiling', 'wall0', 'wall1', 'wall2', 'wall3', 'wall4', 'wall5')
        """
        if not (np.isfinite(height) and height > 0):
            raise SceneError(f"a room needs a positive height, not {height} m")
        corners, ears = cut_ears(polygon)
        wide = float(np.ptp(corners, axis=0).max())
        if not 1e-4 * wide <= height <= 1e4 * wide:
            raise SceneError(
                f"a room {wide:g} m across cannot be {height:g} m high; state metres"
            )
        n = len(corners)
        low = np.column_stack([corners, np.zeros(n)])
        vertices = np.concatenate([low, low + np.array([0, 0, height])])
        i, j = np.arange(n), np.roll(np.arange(n), -1)
        walls = np.stack(
            [np.stack([i, j + n, j], 1), np.stack([i, i + n, j + n], 1)], 1
        )
        faces = np.concatenate([ears, ears[:, ::-1] + n, walls.reshape(-1, 3)])
        flat = ["floor"] * len(ears) + ["ceiling"] * len(ears)
        sides = [f"wall{k}" for k in range(n) for _ in range(2)]
        return MeshGeometry.from_arrays(vertices, faces, flat + sides)

    @staticmethod
    def box(size: ArrayLike) -> "MeshGeometry":
        """Build a box with a corner at the origin; surfaces as `rir.room.WALLS`."""
        size = np.asarray(size, dtype=float)
        corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
        sides = [
            [0, 1, 3, 2],
            [4, 6, 7, 5],
            [0, 4, 5, 1],
            [2, 3, 7, 6],
            [0, 2, 6, 4],
            [1, 5, 7, 3],
        ]
        faces = [t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))]
        walls = [w for w in ("x0", "x1", "y0", "y1", "floor", "ceiling") for _ in "ab"]
        return MeshGeometry.from_arrays(corner * size, faces, walls)

    @property
    def lattice(self) -> bool:
        """Whether images form a lattice: those of a mesh are found one by one."""
        return False

    @property
    def mesh(self) -> "MeshGeometry":
        """The room itself."""
        return self

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
        """Area of each surface that sound reaches [m²], shape (surfaces,).

        In an open mesh both sides of a triangle count, as far as the room lies on them.
        """
        return self._areas

    @cached_property
    def _areas(self) -> FloatArray:
        areas = np.zeros(self.surfaces)
        sides = 1.0 if self.watertight else self.reach.sides.sum(axis=1)
        np.add.at(areas, self.face_surface, self.face_areas * sides)
        return areas

    @cached_property
    def reach(self) -> Reach:
        """What sound reaches of an open mesh: an estimate, see `find_reach`."""
        tree, panel = self.hierarchy.arrays, self.panels.of_face
        return find_reach(self.vertices, self.faces, tree, panel)

    @property
    def volume(self) -> float:
        """Volume of the air [m³]; about that which sound reaches where no shell is."""
        return self._volume

    @cached_property
    def _volume(self) -> float:
        if self.watertight:
            return abs(signed_volume(self.corners))
        if len(self.shell):
            return abs(signed_volume(self.corners[self.shell]))
        if self.reach.volume > 0:
            return self.reach.volume
        # nothing that most directions meet: a wall or two in the open
        return hull_volume(self.vertices)

    @property
    def volume_error(self) -> float:
        """Standard error of the volume [m³]; 0 where surfaces enclose it."""
        if len(self.shell):
            return 0.0
        # a hull around a wall or two says little of the air that sound is in
        return self.reach.error if self.reach.volume > 0 else self.volume / 2

    @property
    def open_share(self) -> float:
        """Share of the directions from points in the room that meet no surface."""
        return 0.0 if len(self.shell) else self.reach.open_share

    @property
    def estimates(self) -> tuple[str, ...]:
        """What is known about the size of an open mesh, in words."""
        if len(self.shell):
            return ()
        return (self.reach.described(self.volume, float(self.areas.sum())),)

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
        blocking = np.isin(self.panels.of_face, self.occluders)
        return make_tables(self.corners, blocking)

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
        """Tell which points, (N, 3), are in free sight of one or of N; all local."""
        starts = np.broadcast_to(point, others.shape).copy()
        tree, panel = self.hierarchy.arrays, self.panels.of_face
        return free_ways(tree, panel, starts, others, 1e-9 * self.diagonal)

    def visible(self, a: ArrayLike, b: ArrayLike) -> NDArray[np.bool_]:
        """Tell which of N segments from `a` to `b`, shape (N, 3), are free."""
        starts, ends = np.broadcast_arrays(self.localised(a), self.localised(b))
        return self.sees(starts, ends.copy())

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

    def facing(self) -> FloatArray:
        """Return how much of each wall of a box each surface is, (6, surfaces).

        Weights are areas as seen along an axis; a wall that nothing faces is the mean.
        """
        normal = self.tables.planes[:, :3]
        thin = ~self.panels.sided[self.panels.of_face]
        total = np.tile(self.areas / self.areas.sum(), (6, 1))
        for wall in range(6):
            along = normal[:, wall // 2] * (1 if wall % 2 == 0 else -1)
            seen = np.where(thin, np.abs(along), np.maximum(along, 0.0)) ** 2
            weights = np.zeros(self.surfaces)
            np.add.at(weights, self.face_surface, seen * self.face_areas)
            if weights.sum() > 0:
                total[wall] = weights / weights.sum()
        return total
