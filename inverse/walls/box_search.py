"""Suppose rooms and keep the one that explains the low sound: frames, hidden walls.

A loudspeaker with its back to a wall does not light it: the wall is heard by way of
others only, and what is read as its first echo may be the echo of two walls. Whole
boxes are therefore told apart by all their images, with the loudspeaker's pattern.
"""

from dataclasses import dataclass, replace

import numpy as np

from inverse.paths.oriented_box import FAR_M, OrientedBox
from inverse.paths.room import BoxRoom
from inverse.rows.direct import DirectSound
from inverse.rows.fitset import FitSet
from inverse.walls.box import SAME_WALL_M, walled
from inverse.walls.low_sound import LowSound, TriedRoom
from inverse.walls.scan import ScanSignals
from rir.arrays import FloatArray

__all__ = ["SearchedBox", "search_box"]

TURNS, MOVING_TURNS = 2, 6  # of a fit of factors, and of walls and factors
SWEPT_ROWS, SWEPT_ORDER = 24, 8  # a sweep ranks places only; few rows and images do
STEP_M, REACH_M, NEAREST_M = 0.05, 7.0, 0.03
"""Places of a sweep: 0.1 m of path apart, a quarter of a wave of 800 Hz, from clear of
the poses to where a wall's first echo nears the end of the 50 ms that are looked at."""
BEST = 5  # deepest dips of a sweep that are fitted (decision 0067)
ROUNDS = 3  # a wall put right moves the best places of others
CLEAR = 0.01  # a box that leaves less of the low sound is the room
BETTER = 0.97  # of what is unexplained: a place is kept for 3 % less (decision 0067)
POOR, FEW_PLACES, YAW_STEP_DEG = 0.1, 3, 1.5
"""A box that leaves a tenth, heard from so few places, may stand in another frame:
upright ones are tried, no farther apart than a fit of the geometry turns."""
STILL = 0.3  # part of what walls should explain that a poor box leaves
TRIED_FACTOR = 0.75  # of a wall put elsewhere, before its fit: a common plaster's
NEEDLESS, UNSURE = 1.01, 1.15
"""A wall that is left out, and one that is doubted; see `SearchedBox.doubts`."""
SILENT = 0.02  # reflection factor of no wall


@dataclass(frozen=True, eq=False)
class SearchedBox:
    """Hold the likeliest box and what else each wall could be."""

    box: OrientedBox
    """The walls."""
    room: BoxRoom
    """Its walls, their factors and the emitter's pattern, as the low sound tells."""
    unexplained: float
    """Part of the low energy it leaves."""
    doubts: FloatArray
    """What is left over if a wall stood elsewhere or nowhere, over what is left now;
    infinite where that was not asked. Shape (6,)."""

    @property
    def unsure(self) -> list[int]:
        """Walls that could nearly as well stand elsewhere or nowhere."""
        if self.unexplained < POOR:
            return []
        return np.flatnonzero(self.box.found & (self.doubts < UNSURE)).tolist()


def search_box(
    rows: FitSet,
    direct: DirectSound,
    boxes: list[OrientedBox],
    signals: list[ScanSignals] | None = None,
) -> SearchedBox:
    """Return the box whose images explain the low sound best.

    Parameters
    ----------
    rows, direct
        Measured rows, and their direct sounds.
    boxes : list of OrientedBox
        Frames that may be the room's, with the walls heard along each.
    signals : list of ScanSignals, optional
        To look for walls along other upright frames with, where there are few
        emitter places and none of the boxes explains the rows.
    """
    low = LowSound.of(rows, direct)
    best, doubts = _best_box(low, boxes)
    air = low.tried(low.room(best.box.without_walls()), TURNS)
    poor = best.left > min(POOR, STILL * air.left)
    if poor and signals is not None and rows.n_places <= FEW_PLACES:
        other, others = _best_box(low, [walled(signals, one) for one in _upright()])
        if other.left < BETTER * best.left:
            best, doubts = other, others
    best = _without_needless(low, best, doubts)
    return SearchedBox(best.box, low.without_lead(best.room), best.left, doubts)


def _without_needless(low: LowSound, best: TriedRoom, doubts: FloatArray) -> TriedRoom:
    """Return the room without walls that explain nothing: none is invented."""
    silent = np.abs(best.room.walls) < SILENT
    needless = best.box.found & ((doubts < NEEDLESS) | silent)
    for wall in np.flatnonzero(needless):
        # two that stand in for each other must not both go
        fewer = low.tried(_with_wall(best.room, int(wall), None), TURNS)
        if fewer.left < NEEDLESS * max(best.left, CLEAR):
            best = fewer
    return best


def _upright() -> FloatArray:
    """Return frames with a level floor, a few degrees apart, (K, 3, 3)."""
    from scipy.spatial.transform import Rotation

    turns = np.arange(-45.0, 45.0, YAW_STEP_DEG)
    return Rotation.from_euler("z", turns[:, None], degrees=True).as_matrix()


def _best_box(low: LowSound, boxes: list[OrientedBox]) -> tuple[TriedRoom, FloatArray]:
    """Return the best of the boxes, each wall at its best, and the walls' doubts."""
    trials = [low.tried(low.room(box), TURNS) for box in boxes]
    best = min(trials, key=lambda trial: trial.left)
    best = low.tried(best.room, MOVING_TURNS, geometry=True)
    doubts = np.full(6, np.inf)
    for _ in range(ROUNDS):
        if best.left < CLEAR:
            return best, np.full(6, np.inf)
        before = best
        for wall in range(6):
            if best.left > CLEAR:
                best, doubts[wall] = _placed(low, best, wall)
        if best is before:
            break
        best = low.tried(best.room, MOVING_TURNS, geometry=True)
    return best, doubts


def _placed(low: LowSound, now: TriedRoom, wall: int) -> tuple[TriedRoom, float]:
    """Try a wall elsewhere; return the best and how much worse the next is."""
    tried = [low.tried(_with_wall(now.room, wall, None), TURNS)]
    for place in _likely_places(low, now.room, wall):
        tried.append(low.tried(_with_wall(now.room, wall, place), TURNS))
    other = min(tried, key=lambda trial: trial.left)
    if other.left < BETTER * now.left:
        return other, now.left / other.left
    return now, other.left / now.left


def _likely_places(low: LowSound, room: BoxRoom, wall: int) -> list[float]:
    """Return where a wall would lower what is left most, the present place aside."""
    few = low.rows.spread(SWEPT_ROWS)
    ends = room.box.inside(
        np.concatenate([low.rows.emitters.positions, low.rows.listeners.positions])
    )[:, wall // 2]
    sign = 1.0 if wall % 2 else -1.0
    first = float((sign * ends).max()) + NEAREST_M
    places = sign * (first + STEP_M * np.arange(round(REACH_M / STEP_M)))
    plain = replace(room, order=SWEPT_ORDER)
    tried = [_with_wall(plain, wall, place) for place in places]
    unexplained = np.array([low.left(one, few) for one in tried])
    inner = np.concatenate([[np.inf], unexplained, [np.inf]])
    dips = np.flatnonzero((unexplained <= inner[:-2]) & (unexplained < inner[2:]))
    dips = dips[np.argsort(unexplained[dips])]
    now = _place(room.box, wall)
    return [float(p) for p in places[dips] if abs(p - now) > SAME_WALL_M][:BEST]


def _place(box: OrientedBox, wall: int) -> float:
    return float((box.high if wall % 2 else box.low)[wall // 2])


def _with_wall(room: BoxRoom, wall: int, place: float | None) -> BoxRoom:
    """Return the room with a wall moved; without it where no place is given."""
    low, high, z = room.box.low.copy(), room.box.high.copy(), room.box.z.copy()
    moved, far = (high, FAR_M) if wall % 2 else (low, -FAR_M)
    moved[wall // 2] = far if place is None else place
    walls = room.walls.copy()
    walls[wall] = 1e-3 if place is None else TRIED_FACTOR
    if place is None:
        z[wall] = 0.0
    return replace(room, shape=replace(room.box, low=low, high=high, z=z), walls=walls)
