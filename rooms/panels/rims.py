"""Where the faces of a room end, and what follows there.

At an edge a face may go on: a neighbour in the same plane continues it, and so does its
own image in a neighbour at a right angle. Unfolded about the edge, copies of the faces
stand at multiples of the opening; the one that comes closest to the plane of the face
continues it, and the angle that it stands off the plane says how well. A corner that
opens pi/n into the room therefore takes nothing from a mirror, a rim everything.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray, IntArray
from rooms.mesh import MeshGeometry
from rooms.panels.edges import Borders, find_borders
from rooms.panels.gaps import find_gaps

__all__ = ["Rims", "rims_of"]

_JOINED = 1e-3
"""Angle [rad] up to which what follows counts as in the plane: over a hundred metres a
wave of 8 kHz notices it."""


_SLIGHT = 0.1
"""Bend [rad] that takes no more than 1 % of what a rim takes."""

_BLUNT, _THIN = 0.5, 0.9
"""Passage of edges that open more than 240 and 327 degrees: jambs, and rims."""


@dataclass(frozen=True, eq=False)
class Rims:
    """Each panel of a mesh as a rectangle of its area and second moments.

    The first index behind the panel is the side that sound meets: 0 the one its
    normal points to, 1 the other. Panels that are no rectangles end, on each side of
    theirs, as their borders on that side do on average.

    Parameters
    ----------
    axes : ndarray, shape (P, 2, 3)
        Unit vectors along the sides; zero where a panel ends nowhere.
    center : ndarray, shape (P, 3)
        Middle of each rectangle, relative to the origin of the mesh [m].
    low, high : ndarray, shape (P, 2, 2)
        Ends along both axes from the middle [m]; infinite where the panel goes on.
    bend, passage, gap : ndarray, shape (P, 2, 2, 2)
        What follows at each end (low, high) of each axis, see `Faces`.
    area : ndarray, shape (P,)
        Area of each panel [m²].
    met : ndarray, shape (P, 2)
        Share of each side that the room lies on.
    """

    axes: FloatArray
    center: FloatArray
    low: FloatArray
    high: FloatArray
    bend: FloatArray
    passage: FloatArray
    gap: FloatArray
    area: FloatArray
    met: FloatArray

    @property
    def limited(self) -> NDArray[np.bool_]:
        """Whether a panel ends, seen from a side that lies in the room, (P, 2)."""
        # what lies in no room is met from both sides
        met = (self.met > 0) | ~np.any(self.met > 0, axis=1, keepdims=True)
        return np.any(self.bend > _SLIGHT, axis=(2, 3)) & met


@lru_cache(maxsize=16)
def rims_of(geometry: MeshGeometry) -> Rims:
    """Return the rectangles of all panels, found once per room."""
    panels = geometry.panels
    count = len(panels)
    borders = find_borders(geometry)
    ended = np.unique(borders.panel[np.any(borders.bend > _SLIGHT, axis=1)])
    axes, center, half = _rectangles(geometry, ended)
    bend, passage, mirrored = _ends(borders, axes, count)
    # between thin reflectors in a row the air moves as around each one alone
    blunt = (passage > _BLUNT) & (passage <= _THIN)
    gap = find_gaps(panels, axes, center, half, np.asarray(blunt.any(axis=(1, 2, 3))))
    gap = np.where(blunt, gap, np.inf)
    passage = np.where(np.isfinite(gap), 0.0, passage)
    low = np.broadcast_to(-half[:, None], (count, 2, 2)).copy()
    high = -low
    _unfold(low, high, (bend, passage, gap), mirrored)
    area = np.zeros(count)
    np.add.at(area, panels.of_face, geometry.face_areas)
    met = _met(geometry)
    return Rims(axes, center, low, high, bend, passage, gap, area, met)


def _rectangles(
    geometry: MeshGeometry, ended: IntArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return axes, middles and half sides of rectangles; nothing of endless panels."""
    panels = geometry.panels
    axes = np.zeros((len(panels), 2, 3))
    center, half = np.zeros((len(panels), 3)), np.ones((len(panels), 2))
    for panel in ended:
        first, last = panels.face_start[panel : panel + 2]
        faces = panels.faces[first:last]
        hull = panels.hull[slice(*panels.hull_start[panel : panel + 2])]
        axes[panel] = _axes(hull, panels.normal[panel])
        area = geometry.face_areas[faces]
        corners = geometry.corners[faces]
        center[panel] = area @ corners.mean(axis=1) / area.sum()
        flat = (corners - center[panel]) @ axes[panel].T
        # second moment of a triangle from its corners
        square = (flat**2).sum(axis=1) + flat.sum(axis=1) ** 2
        spread = np.sqrt(3 * (area @ square) / (12 * area.sum()))
        half[panel] = spread * np.sqrt(area.sum() / (4 * np.prod(spread)))
    return axes, center, half


def _met(geometry: MeshGeometry) -> FloatArray:
    """Return how much of each side of panels lies in the room, shape (P, 2)."""
    panels = geometry.panels
    if geometry.watertight:
        one_sided = np.asarray(panels.sided, dtype=float)
        return np.stack([np.ones(len(panels)), 1.0 - one_sided], axis=1)
    normal = geometry.tables.planes[:, :3]
    along = np.einsum("fs,fs->f", normal, panels.normal[panels.of_face]) > 0
    # of the sides against and along a triangle's normal, first the panel's own
    against, ahead = geometry.reach.sides.T * geometry.face_areas
    met = np.zeros((len(panels), 2))
    np.add.at(met[:, 0], panels.of_face, np.where(along, ahead, against))
    np.add.at(met[:, 1], panels.of_face, np.where(along, against, ahead))
    area = np.bincount(panels.of_face, geometry.face_areas, len(panels))
    return met / area[:, None]


def _axes(hull: FloatArray, normal: FloatArray) -> FloatArray:
    """Return the sides of the smallest rectangle around a hull, shape (2, 3)."""
    ways = np.roll(hull, -1, axis=0) - hull
    ways = ways[np.argsort(-np.linalg.norm(ways, axis=1), kind="stable")]
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    across = np.cross(normal, ways)
    room = np.ptp(ways @ hull.T, axis=1) * np.ptp(across @ hull.T, axis=1)
    # the longest side, unless another is better than by rounding
    best = int(np.argmax(room < room.min() * (1 + 1e-9)))
    return np.stack([ways[best], across[best]])


def _ends(
    borders: Borders, axes: FloatArray, count: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the mean bend, passage and share of mirrors at each end of each axis."""
    along = np.einsum("ns,nas->na", borders.outward, axes[borders.panel])
    weight = np.stack([np.maximum(-along, 0), np.maximum(along, 0)], axis=2)
    weight *= borders.length[:, None, None]
    total = np.zeros((count, 2, 2))
    np.add.at(total, borders.panel, weight)
    means = []
    for values in (borders.bend, borders.passage, borders.mirrored):
        # shape: rows, sides of the panel, axes, ends
        part = values[:, :, None, None] * weight[:, None]
        mean = np.zeros((count, 2, 2, 2))
        np.add.at(mean, borders.panel, part)
        means.append(mean / np.maximum(total, 1e-300)[:, None])
    return means[0], means[1], means[2]


def _unfold(
    low: FloatArray,
    high: FloatArray,
    ends: tuple[FloatArray, FloatArray, FloatArray],
    mirrored: FloatArray,
) -> None:
    """Extend panels, in place, to where they end with what continues them.

    The image of a face in its neighbour is as wide as the face, and ends as it does.
    """
    bend, passage, gap = ends
    width = high - low
    joined = bend <= _JOINED
    both = joined.all(axis=3)
    for end, reach, outward in ((0, low, -1.0), (1, high, 1.0)):
        other = 1 - end
        alone = joined[..., end] & ~joined[..., other]
        image = alone & (mirrored[..., end] > 0.5)
        reach[image] += outward * width[image]
        for values in ends:
            values[image, end] = values[image, other]
        reach[(alone & ~image) | both] = outward * np.inf
    # what goes on for ever has no end to lose sound at
    for end, reach in ((0, low), (1, high)):
        endless = np.isinf(reach)
        bend[endless, end] = passage[endless, end] = 0.0
        gap[endless, end] = np.inf
