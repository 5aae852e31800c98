"""Rooms parted by upright planes: walls hide what stands behind them.

Where emitters stand in line with a door most pairs see each other, and who sees
whom is too even a graph to fall apart by itself. A plane between two rooms needs few
numbers and cannot follow the accidents of single pairs.
"""

import numpy as np
from numpy.typing import NDArray

from inverse.rows.membership import WRONG
from rir.arrays import FloatArray, IntArray

__all__ = ["split_by_planes"]

TURNS, OFFSETS = 36, 60
"""Planes tried: 5 degrees and a sixtieth of the room apart, finer than places stand."""
LEAST_SIDE = 3  # places behind a plane: two may be hidden by a piece of furniture
SEEN_ACROSS = 0.9
"""Most of the pairs that see each other through a door; more are one room."""
PRICE = 6.0  # nepers that a plane has to bring for its two numbers and the choice of it


def split_by_planes(
    places: FloatArray, pairs: IntArray, seen: FloatArray, numbers: IntArray
) -> tuple[IntArray, float]:
    """Return regions with one of them split by a plane, and their log likelihood.

    Parameters
    ----------
    places : ndarray, shape (places, 3)
        Known places, metres.
    pairs : ndarray, shape (2, pairs)
        Numbers of both places of each pair.
    seen : ndarray, shape (pairs,)
        1 where they see each other, 0 where not.
    numbers : ndarray, shape (places,)
        Region of each place.
    """
    first, second = pairs
    same = numbers[first] == numbers[second]
    best, most = numbers, -np.inf
    for region in np.unique(numbers):
        mine = numbers == region
        sides = _sides(places, mine)
        if len(sides) == 0:
            continue
        inner = mine[first] & mine[second]
        cut = sides[:, first[inner]] != sides[:, second[inner]]
        cuts, cuts_seen = cut.sum(axis=1), cut @ seen[inner]
        scores = _likelihoods(
            (same.sum() - cuts, (seen * same).sum() - cuts_seen),
            ((~same).sum() + cuts, (seen * ~same).sum() + cuts_seen),
        )
        if scores.max() > most:
            # the wall may be anywhere between places; the middle of all good planes
            alike = np.flatnonzero(scores == scores.max())
            side = sides[alike[len(alike) // 2]]
            most = float(scores.max())
            best = np.where(mine & side, numbers.max() + 1, numbers)
    return best, most - PRICE


def _sides(places: FloatArray, mine: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return for many upright planes which places lie behind them, (planes, places)."""
    turns = np.pi * np.arange(TURNS) / TURNS
    along = places[:, :2] @ np.array([np.cos(turns), np.sin(turns)])
    low, high = along[mine].min(axis=0), along[mine].max(axis=0)
    share = (np.arange(OFFSETS) + 1) / (OFFSETS + 1)
    offsets = low + share[:, None] * (high - low)
    sides = along.T[:, None] > offsets.T[..., None]
    sides = sides.reshape(-1, len(places))
    count = sides[:, mine].sum(axis=1)
    kept = (count >= LEAST_SIDE) & (count <= mine.sum() - LEAST_SIDE)
    return sides[kept]


def _likelihoods(
    same: tuple[FloatArray, FloatArray], other: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """Return log likelihoods from counts of pairs, and of those seen, by plane."""
    within = _share(*same, 0.97, WRONG, 1 - WRONG)
    across = _share(*other, 0.1, WRONG, SEEN_ACROSS)
    total = np.zeros(len(within))
    for (count, seen), chance in ((same, within), (other, across)):
        total += seen * np.log(chance) + (count - seen) * np.log(1 - chance)
    return np.where(within < across + 0.1, -np.inf, total)


def _share(
    count: FloatArray, seen: FloatArray, prior: float, low: float, high: float
) -> FloatArray:
    return np.clip((seen + 2 * prior) / (count + 2), low, high)
