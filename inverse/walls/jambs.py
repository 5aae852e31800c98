"""Upright edges that sound bends around: the jambs of doors.

Between ends that do not see each other, the first sound comes round an edge. An
upright edge at distances r and s from the two ends, seen from above, is passed on a
way of length sqrt((r + s)^2 + h^2), h their difference in height: a search in two
dimensions, whatever the room.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Jamb", "scan_jambs", "way_lengths"]

FloatArray = NDArray[np.float64]
STEP_M, FINE_M = 0.05, 0.01
WIDTH_M, FINE_WIDTH_M = 0.06, 0.025
INSIDE_M = 0.07
LEAST_PAIRS, LEAST_SHARE = 8, 0.06
MOST = 6
OVER_CHANCE = 1.6
DEALT = 0.2, 0.4, 0.6, 0.8
STEPS = 6


@dataclass(frozen=True, eq=False)
class Jamb:
    """Hold an upright edge.

    Parameters
    ----------
    place : ndarray, shape (2,)
        Seen from above, metres.
    pairs : ndarray of int
        Pairs whose first sound came round it.
    spread_m : float
        Standard deviation of their ways about what the edge tells.
    """

    place: FloatArray
    pairs: NDArray[np.int64]
    spread_m: float


def way_lengths(edges: FloatArray, first: FloatArray, second: FloatArray) -> FloatArray:
    """Return lengths of the ways round upright edges, shape (edges, pairs).

    Parameters
    ----------
    edges : ndarray, shape (edges, 2)
        Seen from above.
    first, second : ndarray, shape (pairs, 3)
        Both ends.

    Examples
    --------
    >>> ends = np.array([[0.0, 0.0, 1.0]]), np.array([[3.0, 3.0, 1.0]])
    >>> way_lengths(np.array([[0.0, 3.0]]), *ends).tolist()
    [[6.0]]
    """
    flat = [
        np.hypot(*np.moveaxis(edges[:, None] - one[:, :2], -1, 0))
        for one in (first, second)
    ]
    return np.hypot(flat[0] + flat[1], first[:, 2] - second[:, 2])


def scan_jambs(
    first: FloatArray, second: FloatArray, lengths: FloatArray
) -> list[Jamb]:
    """Return the upright edges that first arrivals agree on, the clearest first.

    Parameters
    ----------
    first, second : ndarray, shape (pairs, 3)
        Ends that do not see each other, metres.
    lengths : ndarray, shape (pairs,)
        Shortest way sound took, metres.

    Notes
    -----
    Each further edge has to be told by pairs that no clearer one explains. An edge
    counts where many more pairs agree on it than on any place once detours are dealt
    to other pairs.
    """
    ends = np.concatenate([first, second])[:, :2]
    low, high = ends.min(axis=0), ends.max(axis=0)
    axes = [np.arange(a, b + STEP_M, STEP_M) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    left = np.arange(len(lengths))
    least = max(LEAST_PAIRS, LEAST_SHARE * len(lengths))
    found: list[Jamb] = []
    while len(found) < MOST and len(left) >= least:
        ends = first[left], second[left]
        ways = way_lengths(grid, *ends)
        direct = np.linalg.norm(ends[0] - ends[1], axis=1)
        chance = max(
            _best(grid, ways, ends, direct + _dealt(lengths[left] - direct, part))[1]
            for part in DEALT
        )
        place, score = _best(grid, ways, ends, lengths[left])
        gap = way_lengths(place[None], *ends)[0] - lengths[left]
        near = np.flatnonzero(np.abs(gap) < INSIDE_M)
        if len(near) < least or score < OVER_CHANCE * chance:
            break
        spread = float(np.sqrt((gap[near] ** 2).mean()))
        found.append(Jamb(place, left[near], spread))
        left = np.delete(left, near)
    return found


def _best(
    grid: FloatArray,
    ways: FloatArray,
    ends: tuple[FloatArray, FloatArray],
    lengths: FloatArray,
) -> tuple[FloatArray, float]:
    """Return the place most pairs agree on, and how well."""
    place = grid[int(np.argmax(_votes(ways, lengths, WIDTH_M)))]
    steps = np.arange(-STEPS, STEPS + 1) * FINE_M
    near = np.stack(np.meshgrid(steps, steps, indexing="ij"), -1).reshape(-1, 2)
    score = 0.0
    for _ in range(2):
        tried = place + near
        votes = _votes(way_lengths(tried, *ends), lengths, FINE_WIDTH_M)
        place, score = tried[int(np.argmax(votes))], float(votes.max())
    return place, score


def _dealt(values: FloatArray, part: float) -> FloatArray:
    return np.roll(values, max(round(part * len(values)), 1))


def _votes(ways: FloatArray, lengths: FloatArray, width: float) -> FloatArray:
    gap = (ways - lengths) / width
    return np.maximum(1 - 0.25 * gap * gap, 0).sum(axis=1)
