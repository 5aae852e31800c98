"""Rooms bounded by triangles: how they are built, and the ways of sound in them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir.errors import SceneError
from rir.numbers import read_number
from rooms.mesh.arrays import check_arrays, surface_ids
from rooms.mesh.cleaning import Cleaned, clean
from rooms.mesh.crossings import Crossings, find_crossings
from rooms.mesh.images import Paths, find_paths
from rooms.mesh.loading import load_mesh
from rooms.mesh.panels import Panels, find_panels
from rooms.mesh.polygon import cut_ears
from rooms.mesh.shell import closed_shell
from rooms.mesh.triangles import Triangles

__all__ = ["MeshGeometry"]

FloatArray = NDArray[np.float64]
_RELATIVE = 1e-6
"""Share of the diagonal within which points count as one."""


@dataclass(frozen=True, eq=False)
class MeshGeometry(Triangles):
    """A room made of triangles, as `rooms.geometry.Geometry` asks for it.

    Build one by `from_file`, `from_arrays`, `extruded` or `box`; its parts are those
    of `Triangles`.

    Examples
    --------
    >>> room = MeshGeometry.box((6, 5, 3))
    >>> room.volume, len(room.panels), room.watertight
    (90.0, 6, True)
    """

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
            _told(mesh, panels),
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

    # -- what effects ask -------------------------------------------------------------

    @property
    def lattice(self) -> bool:
        """False: images of a mesh are found one by one."""
        return False

    @property
    def mesh(self) -> "MeshGeometry":
        """The room itself."""
        return self

    def in_sight(self, emitter: ArrayLike, listeners: ArrayLike) -> NDArray[np.bool_]:
        """Tell to which listeners, shape (L, 3), the straight way is free."""
        seen = find_paths(self, emitter, listeners, max_order=0).listener
        return np.isin(np.arange(len(np.asarray(listeners))), seen)

    def mirror_paths(
        self,
        emitter: ArrayLike,
        listeners: ArrayLike,
        *,
        max_order: int,
        max_length: float,
    ) -> Paths:
        """Return every mirror path but the straight way; see `find_paths`."""
        return find_paths(
            self,
            emitter,
            listeners,
            max_order=max_order,
            max_length=max_length,
            direct=False,
        )

    def crossings(self, start: FloatArray, ends: FloatArray) -> Crossings:
        """Return what straight ways from a start to ends, shape (N, 3), pass through.

        See `find_crossings`.
        """
        return find_crossings(self, start, ends)

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


def _told(mesh: Cleaned, panels: Panels) -> tuple[str, ...]:
    merged = len(mesh.faces) - len(panels)
    told = [*mesh.report]
    if merged:
        told.append(f"merged {len(mesh.faces)} triangles into {len(panels)} panels")
    if not mesh.watertight:
        open_ = "the mesh does not enclose the air: both sides of it reflect"
        if len(closed_shell(mesh.vertices, mesh.faces)):
            open_ = "open surfaces stand in a closed shell: both sides of all reflect"
        told.append(open_)
    return tuple(told)
