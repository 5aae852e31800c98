"""Devices and their first mirror images, as the ends of ways around edges."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray, IntArray
from rooms.mesh import MeshGeometry

__all__ = ["Ends", "Legs", "are_mirrored", "mirrored_ends"]

_SLACK = 1e-9  # of the diagonal: far above rounding, far below a wavelength


@dataclass(frozen=True, eq=False)
class Ends:
    """Places that ways start from or lead to."""

    owner: IntArray
    """Number of the device. Shape (n,)."""
    place: FloatArray
    """Where the device is. Shape (n, 3)."""
    image: FloatArray
    """Where it seems to be: the same, or behind a mirror. Shape (n, 3)."""
    panel: IntArray
    """The mirror, or -1. Shape (n,)."""

    def __len__(self) -> int:
        return len(self.owner)

    def __getitem__(self, rows: IntArray | slice | NDArray[np.bool_]) -> "Ends":
        return Ends(
            self.owner[rows], self.place[rows], self.image[rows], self.panel[rows]
        )

    @property
    def mirrored(self) -> NDArray[np.bool_]:
        """Which ends lie behind a mirror."""
        return self.panel >= 0


@dataclass(frozen=True, eq=False)
class Legs:
    """Ways from ends to one point each."""

    free: NDArray[np.bool_]
    """Whether nothing stands in the way, and the mirror reaches far enough. Shape
    (n,)."""
    facing: FloatArray
    """Unit vectors out of the device. Shape (n, 3)."""
    surface: IntArray
    """Surface that mirrors, or -1. Shape (n,)."""

    @staticmethod
    def between(geometry: MeshGeometry, ends: Ends, points: FloatArray) -> "Legs":
        """Follow each end to its point, shape (n, 3); all local to the mesh."""
        bent = ends.mirrored
        target = points.copy()
        free = np.ones(len(ends), dtype=bool)
        surface = np.full(len(ends), -1, dtype=np.int64)
        if bent.any():
            spots, faces, above = _mirror_points(geometry, ends[bent], points[bent])
            target[bent] = spots
            free[bent] = faces >= 0
            surface[bent] = np.where(faces >= 0, geometry.face_surface[faces], -1)
            lift = 10 * geometry.tolerance * above[:, None]
            spots = spots + lift * geometry.panels.normal[ends.panel[bent]]
            rows = np.nonzero(bent)[0][faces >= 0]
            free[rows] &= _are_free(geometry, spots[faces >= 0], points[rows])
            target[rows] = spots[faces >= 0]
        rows = np.nonzero(free)[0]
        free[rows] &= _are_free(geometry, ends.place[rows], target[rows])
        way = target - ends.place
        span = np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-300)
        return Legs(free, way / span, surface)


def _are_free(
    geometry: MeshGeometry, starts: FloatArray, ends: FloatArray
) -> NDArray[np.bool_]:
    from rooms.mesh.hits import free_ways

    return free_ways(
        geometry.hierarchy.arrays,
        geometry.panels.of_face,
        np.ascontiguousarray(starts),
        np.ascontiguousarray(ends),
        _SLACK * geometry.diagonal,
    )


def _mirror_points(
    geometry: MeshGeometry, ends: Ends, points: FloatArray
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Return where ways meet their mirrors, in which triangle or -1, and the side."""
    panels = geometry.panels
    normal, offset = panels.normal[ends.panel], panels.offset[ends.panel]
    behind = np.einsum("ij,ij->i", normal, ends.image) - offset
    before = np.einsum("ij,ij->i", normal, points) - offset
    crosses = behind * before < 0
    part = behind / np.where(crosses, behind - before, 1.0)
    spots = ends.image + part[:, None] * (points - ends.image)
    faces = np.full(len(ends), -1, dtype=np.int64)
    slack = _SLACK * geometry.diagonal
    for panel in np.unique(ends.panel[crosses]):
        rows = np.nonzero(crosses & (ends.panel == panel))[0]
        first, last = panels.face_start[panel], panels.face_start[panel + 1]
        within = panels.faces[first:last]
        rims = geometry.tables.rims[within]
        depth = np.einsum("tsk,nk->nts", rims[..., :3], spots[rows]) - rims[..., 3]
        inside = np.all(depth >= -slack, axis=2)
        found = inside.any(axis=1)
        faces[rows[found]] = within[inside[found].argmax(axis=1)]
    return spots, faces, np.sign(before)


def mirrored_ends(geometry: MeshGeometry, places: FloatArray, mirrors: bool) -> Ends:
    """Return devices at places, shape (N, 3), and their images in all panels.

    A panel that only has air on one side mirrors only what lies there.
    """
    count = len(places)
    owner, none = np.arange(count), np.full(count, -1, dtype=np.int64)
    plain = Ends(owner, places, places, none)
    if not mirrors:
        return plain
    panels = geometry.panels
    height = places @ panels.normal.T - panels.offset
    aside = np.where(panels.sided, height, np.abs(height)) > 10 * geometry.tolerance
    who, panel = np.nonzero(aside)
    away = 2 * height[who, panel][:, None] * panels.normal[panel]
    return Ends(
        np.concatenate([owner, who]),
        np.concatenate([places, places[who]]),
        np.concatenate([places, places[who] - away]),
        np.concatenate([none, panel]),
    )


def are_mirrored(
    geometry: MeshGeometry, panel: IntArray, starts: FloatArray, ends: FloatArray
) -> NDArray[np.bool_]:
    """Tell whether each panel shows the start, shape (n, 3), to the end in a mirror."""
    normal = geometry.panels.normal[panel]
    height = np.einsum("ij,ij->i", normal, starts) - geometry.panels.offset[panel]
    images = starts - 2 * height[:, None] * normal
    none = np.zeros(len(panel), dtype=np.int64)
    return _mirror_points(geometry, Ends(none, starts, images, panel), ends)[1] >= 0
