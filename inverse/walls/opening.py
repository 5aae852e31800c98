"""The hole that joins two rooms: where its four edges are, told by first arrivals.

Sound from room to room takes the shortest way through the hole: straight where the
ends see each other, else bent round its edges.
"""

from dataclasses import dataclass, replace

import numpy as np

from rir.arrays import BoolArray, FloatArray

__all__ = ["Opening", "Slab", "find_opening", "find_thickness"]

WIDTH_M = 0.015  # three times the error of first arrivals (decision 0065)
COARSE_M, STEPS_M = 0.15, (0.05, 0.01, 0.003)  # metres, coarse to fine
REACH = 8  # steps to both sides: past one step of the stage before
ROUNDS = 2  # edges depend little on each other
LEAST_M = 0.2  # a narrower hole is no door
KNOWN = 4.0
"""Gain, in nepers, that an edge has to bring over leaving the hole open there: 55 times
as likely."""
THIN_M, THICK_STEP_M, FINE_THICK_M = 0.02, 0.06, (0.012, 0.003)
"""From a board on; then four finer steps to both sides, twice."""
AGREEING_M, LEAST_AGREEING = 0.05, 0.6
"""Arrivals that are read wrong, or come another way, are off by more than 5 cm; where
most are, this is not the hole."""
LEAST_PAIRS = 12  # more than twice the five numbers of a hole in a wall


@dataclass(frozen=True, eq=False)
class Slab:
    """Hold a wall between two rooms."""

    origin: FloatArray
    """A point of the face that looks into the first room. Shape (3,)."""
    frame: FloatArray
    """Rows: into the first room, along the wall, up. Shape (3, 3)."""
    thick: float
    """Metres."""
    limits: FloatArray
    """Where both rooms end along the wall, and up; relative to the origin. Shape
    (4,)."""

    def local(self, points: FloatArray) -> FloatArray:
        """Return points in the frame of the wall, shape (n, 3)."""
        return np.ascontiguousarray((points - self.origin) @ self.frame.T)


@dataclass(frozen=True, eq=False)
class Opening:
    """Hold a hole in a wall."""

    slab: Slab
    """The wall."""
    hole: FloatArray
    """Low and high end along the wall, low and high end up, in its frame. Shape
    (4,)."""
    known: BoolArray
    """Which ends first arrivals tell; the others stand where the rooms end. Shape
    (4,)."""
    agreeing: float
    """Part of the pairs whose first arrival it tells within 5 cm."""

    def ways(self, first: FloatArray, second: FloatArray) -> FloatArray:
        """Return shortest ways from the first room to the second, shape (pairs,)."""
        from inverse.walls.opening_kernel import hole_ways

        out = np.empty(len(first))
        ends = self.slab.local(first), self.slab.local(second)
        hole_ways(*ends, self.slab.thick, self.hole, out)
        return out


def find_opening(
    slab: Slab, first: FloatArray, second: FloatArray, lengths: FloatArray
) -> Opening | None:
    """Return the hole that tells the first arrivals; None where none does.

    Parameters
    ----------
    slab : Slab
        The wall between the rooms.
    first, second : ndarray, shape (pairs, 3)
        Ends in the first and in the second room.
    lengths : ndarray, shape (pairs,)
        Shortest way of each pair, metres; its distance where it sees itself.
    """
    ends = slab.local(first), slab.local(second)
    held = (ends[0][:, 0] > 0) & (ends[1][:, 0] < -slab.thick) & np.isfinite(lengths)
    if held.sum() < LEAST_PAIRS:
        return None
    search = _Search(ends[0][held], ends[1][held], slab.thick, lengths[held])
    hole = search.refined(search.started(slab.limits), slab.limits)
    best = search.cost(hole)
    known = np.zeros(4, dtype=bool)
    for side in range(4):
        wide = hole.copy()
        wide[side] = slab.limits[side]
        known[side] = search.cost(wide) - best > KNOWN
    hole = np.where(known, hole, slab.limits)
    opening = Opening(slab, hole, known, 0.0)
    gap = np.abs(opening.ways(first[held], second[held]) - lengths[held])
    agreeing = float((gap < AGREEING_M).mean())
    if agreeing < LEAST_AGREEING or not known[:2].any():
        return None
    return replace(opening, agreeing=agreeing)


def find_thickness(
    slab: Slab, first: FloatArray, second: FloatArray, lengths: FloatArray
) -> tuple[Opening | None, bool]:
    """Return the hole in a wall no thicker than `slab`, and whether that was told.

    Sound that turns round both edges of a thick wall goes a longer way than round
    a thin one.
    """
    thicks = np.arange(THIN_M, slab.thick, THICK_STEP_M)
    tried = [
        replace(slab, thick=float(thick)) for thick in thicks if thick < slab.thick
    ] or [slab]
    found = [find_opening(one, first, second, lengths) for one in tried]
    costs = [
        np.inf if one is None else _cost(one, first, second, lengths) for one in found
    ]
    best = int(np.argmin(costs))
    opening = found[best]
    if opening is None:
        return None, False
    for step in FINE_THICK_M:
        for move in step * np.arange(-4, 5):
            thick = opening.slab.thick + move
            if not THIN_M / 2 < thick < slab.thick:
                continue
            moved = replace(opening, slab=replace(slab, thick=float(thick)))
            now = _cost(moved, first, second, lengths)
            if now < costs[best]:
                opening, costs[best] = moved, now
    known = min(costs[0], costs[-1]) - costs[best] > KNOWN
    return opening, bool(known)


def _cost(
    opening: Opening, first: FloatArray, second: FloatArray, lengths: FloatArray
) -> float:
    finite = np.isfinite(lengths)
    gap = opening.ways(first[finite], second[finite]) - lengths[finite]
    return float(0.5 * np.log1p((gap / WIDTH_M) ** 2).sum())


@dataclass(frozen=True, eq=False)
class _Search:
    """Look for the hole with the least cost."""

    first: FloatArray
    second: FloatArray
    thick: float
    lengths: FloatArray

    def cost(self, hole: FloatArray) -> float:
        from inverse.walls.opening_kernel import hole_cost

        return float(
            hole_cost(self.first, self.second, self.thick, hole, self.lengths, WIDTH_M)
        )

    def started(self, limits: FloatArray) -> FloatArray:
        """Return the best of a coarse grid of ends along the wall, open above."""
        count = max(int((limits[1] - limits[0]) / COARSE_M), 2)
        places = np.linspace(limits[0], limits[1], count + 1)
        best, least = limits.copy(), self.cost(limits)
        for low in range(count):
            for high in range(low + 1, count + 1):
                hole = np.r_[places[low], places[high], limits[2:]]
                now = self.cost(hole)
                if now < least:
                    best, least = hole, now
        return best

    def refined(self, hole: FloatArray, limits: FloatArray) -> FloatArray:
        """Return the hole with each edge in turn moved to its best."""
        sides = (3, 2, 0, 1)
        for side in (3, 2):
            other = hole[5 - side]
            ends = np.sort([limits[side], other])
            hole = self._best(hole, side, np.arange(ends[0], ends[1] + 0.05, 0.1))
        for step in STEPS_M:
            for _ in range(ROUNDS):
                for side in sides:
                    moves = hole[side] + step * np.arange(-REACH, REACH + 1)
                    low, high = limits[side // 2 * 2], limits[side // 2 * 2 + 1]
                    hole = self._best(hole, side, np.clip(moves, low, high))
        return hole

    def _best(self, hole: FloatArray, side: int, places: FloatArray) -> FloatArray:
        best, least = hole, self.cost(hole)
        for place in places:
            tried = hole.copy()
            tried[side] = place
            pair = side // 2 * 2
            if tried[pair + 1] - tried[pair] < LEAST_M:
                continue
            now = self.cost(tried)
            if now < least - 1e-9:
                best, least = tried, now
        return best
