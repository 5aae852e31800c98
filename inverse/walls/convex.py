"""Convex rooms whose walls are not square to each other: gables, trapezoids.

All poses stand in front of every wall of a convex room, so the free scan finds its
walls as they are; images of higher order stand behind them. The room is where all
half spaces overlap; a plane that bounds no part of it is a phantom.
"""

from dataclasses import dataclass

import numpy as np

from inverse.paths.polyhedral import FittedMesh, fit_polyhedron
from inverse.paths.polyhedron import Polyhedron
from inverse.paths.shoebox import FittedRoom
from inverse.rows.direct import DirectSound
from inverse.rows.fitset import FitSet
from inverse.rows.unexplained import unexplained_energy
from inverse.walls.box import SQUARE_DEG
from inverse.walls.inner_walls import JUDGED_ROWS
from inverse.walls.scan import SURE_Z, FoundPlane
from rir import GainPattern
from rir.arrays import FloatArray

__all__ = ["ConvexTrial", "convex_room", "try_convex"]

SUPPORT = 0.6  # part of the emitters that must speak for a wall, as in decision 0055
FAINT = 0.45  # of a wall within `ALIKE` of it: fainter ones are that wall tilted
ALIKE = np.cos(np.radians(20.0))  # wider hides gables, narrower lets tilts pass
OBLIQUE = np.radians(SQUARE_DEG)
LEAST_AREA = 0.1  # square metres: a smaller face sends back no echo that could be found
LARGEST_M = 60.0  # half the side of the space looked at; corners there are open ends
BETTER = 0.7  # of what a box leaves: a convex room has more to fit with
CLEAN = 0.003  # about -25 dB: paths explain the room
SILENT = 0.15  # a plane that reflects less is no wall of a room that was heard
FLAT = 1e-6  # metres: corners that differ by rounding are one


@dataclass(frozen=True, eq=False)
class ConvexTrial:
    """Hold a fitted convex room and the part of the energy it leaves unexplained."""

    fitted: FittedMesh
    unexplained: float

    def beats(self, rows: FitSet, box: FittedRoom) -> bool:
        """Return whether it leaves clearly less than a box does."""
        return self.unexplained < BETTER * unexplained_energy(
            rows.spread(JUDGED_ROWS), box
        )

    @property
    def is_clean(self) -> bool:
        """Whether hardly anything is left: no box need be asked."""
        return self.unexplained < CLEAN


def try_convex(
    rows: FitSet,
    direct: DirectSound,
    found: list[FoundPlane],
    reach_m: float,
    listening: GainPattern | None = None,
) -> ConvexTrial | None:
    """Fit the convex room of found planes; None where it would be a box, or open.

    Parameters
    ----------
    rows, direct
        Measured rows, and their direct sounds.
    found : list of FoundPlane
        Planes of the free scan.
    reach_m : float
        Longest path, metres.
    listening : GainPattern, optional
        Known pattern of the listener.
    """
    if rows.n_places < 2:
        return None
    shape = convex_room(rows, found)
    if shape is None or not _oblique(shape.planes):
        return None
    try:
        fitted = fit_polyhedron(rows, direct, shape, reach_m, listening)
    except np.linalg.LinAlgError:
        return None
    if np.abs(fitted.room.walls).min() < SILENT:
        return None
    return ConvexTrial(fitted, unexplained_energy(rows.spread(JUDGED_ROWS), fitted))


def convex_room(rows: FitSet, found: list[FoundPlane]) -> Polyhedron | None:
    """Return the room that found planes enclose, None where they leave it open."""
    from scipy.spatial import HalfspaceIntersection, QhullError

    ends = np.concatenate([rows.emitters.positions, rows.listeners.positions])
    planes = _credible(found)
    if len(planes) < 4:
        return None
    middle = ends.mean(axis=0)
    away = planes[:, :3] @ middle - planes[:, 3]
    if away.min() <= 0:
        return None
    walls = np.concatenate([planes, _far_walls(middle)])
    spaces = np.column_stack([-walls[:, :3], walls[:, 3]])
    try:
        corners = HalfspaceIntersection(spaces, middle).intersections
    except QhullError:
        return None
    corners = _apart(corners[np.isfinite(corners).all(axis=1)])
    if len(corners) < 4 or np.abs(corners - middle).max() > LARGEST_M - 1:
        return None
    triangles = [
        _faced(corners[np.abs(corners @ row[:3] - row[3]) < 1e-4], row[:3])
        for row in planes
    ]
    kept = [one for one in triangles if len(one) and _area(one) > LEAST_AREA]
    return Polyhedron.of_triangles(np.concatenate(kept)) if len(kept) >= 4 else None


def _credible(found: list[FoundPlane]) -> FloatArray:
    """Return planes that are walls by themselves, shape (P, 4)."""
    kept: list[FoundPlane] = []
    for plane in sorted(found, key=lambda one: -one.strength):
        if plane.z < SURE_Z or plane.support < SUPPORT:
            continue
        beside = [one for one in kept if one.normal @ plane.normal > ALIKE]
        # beside a wall only its like is another one; fainter are its own tilts
        if all(plane.strength > FAINT * one.strength for one in beside):
            kept.append(plane)
    strongest = max((one.strength for one in kept), default=0.0)
    rows = [one.row for one in kept if one.strength > 0.5 * FAINT * strongest]
    return np.array(rows).reshape(-1, 4)


def _far_walls(middle: FloatArray) -> FloatArray:
    normals = np.concatenate([np.eye(3), -np.eye(3)])
    return np.column_stack([normals, normals @ middle - LARGEST_M])


def _apart(corners: FloatArray) -> FloatArray:
    kept: list[FloatArray] = []
    for corner in corners:
        if all(np.abs(corner - other).max() > FLAT for other in kept):
            kept.append(corner)
    return np.array(kept).reshape(-1, 3)


def _faced(corners: FloatArray, normal: FloatArray) -> FloatArray:
    """Return triangles of a convex face, seen from the air anticlockwise."""
    if len(corners) < 3:
        return np.empty((0, 3, 3))
    middle = corners.mean(axis=0)
    first = corners[0] - middle
    first = first / np.linalg.norm(first)
    second = np.cross(normal, first)
    gap = corners - middle
    ring = corners[np.argsort(np.arctan2(gap @ second, gap @ first))]
    count = len(ring)
    return np.array([(ring[0], ring[k], ring[k + 1]) for k in range(1, count - 1)])


def _area(triangles: FloatArray) -> float:
    a, b, c = np.moveaxis(triangles, 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def _oblique(planes: FloatArray) -> bool:
    """Return whether any two planes are neither parallel nor square."""
    along = np.abs(planes[:, :3] @ planes[:, :3].T)
    angle = np.arccos(np.clip(along, 0, 1))
    return bool(((angle > OBLIQUE) & (angle < np.pi / 2 - OBLIQUE)).any())
