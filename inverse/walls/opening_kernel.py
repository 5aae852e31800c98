"""Shortest ways through a rectangular hole in a thick wall, for many pairs."""

import numpy as np
from numba import njit

__all__ = ["hole_cost", "hole_ways"]

SWEEPS = 12  # at most; ways that change by less than 0.1 mm stop before


@njit(cache=True)
def hole_ways(first, second, thick, hole, out):
    """Fill in the shortest ways from behind a wall to before it.

    Coordinates are depth before the wall's near face, then along and up; the wall
    lies from depth -thick to 0, `first` before it and `second` behind. `hole` is its
    two ends along and its two ends up. The length is convex in the points where the
    way meets the two faces, so that each coordinate in turn is put to its best.
    """
    for k in range(len(first)):
        near, far = first[k, 0], -second[k, 0] - thick
        eu, ev = first[k, 1], first[k, 2]
        lu, lv = second[k, 1], second[k, 2]
        whole = max(near + thick + far, 1e-12)
        share, part = near / whole, (near + thick) / whole
        pu = min(max(eu + share * (lu - eu), hole[0]), hole[1])
        pv = min(max(ev + share * (lv - ev), hole[2]), hole[3])
        qu = min(max(eu + part * (lu - eu), hole[0]), hole[1])
        qv = min(max(ev + part * (lv - ev), hole[2]), hole[3])
        length = 1e18
        for _ in range(SWEEPS):
            pu = _met(near, ev - pv, eu, thick, qv - pv, qu, hole[0], hole[1])
            qu = _met(thick, qv - pv, pu, far, lv - qv, lu, hole[0], hole[1])
            pv = _met(near, eu - pu, ev, thick, qu - pu, qv, hole[2], hole[3])
            qv = _met(thick, qu - pu, pv, far, lu - qu, lv, hole[2], hole[3])
            before = length
            length = np.sqrt(near**2 + (eu - pu) ** 2 + (ev - pv) ** 2)
            length += np.sqrt(thick**2 + (qu - pu) ** 2 + (qv - pv) ** 2)
            length += np.sqrt(far**2 + (lu - qu) ** 2 + (lv - qv) ** 2)
            if before - length < 1e-4:
                break
        out[k] = length


@njit(cache=True)
def _met(depth, side, one, behind, beyond, other, low, high):
    a = np.sqrt(depth * depth + side * side)
    b = np.sqrt(behind * behind + beyond * beyond)
    if a + b < 1e-12:
        return min(max(0.5 * (one + other), low), high)
    return min(max((one * b + other * a) / (a + b), low), high)


@njit(cache=True)
def hole_cost(first, second, thick, hole, lengths, width):
    """Return how badly a hole tells the first arrivals, in nepers."""
    ways = np.empty(len(first))
    hole_ways(first, second, thick, hole, ways)
    total = 0.0
    for k in range(len(first)):
        gap = (ways[k] - lengths[k]) / width
        total += 0.5 * np.log(1.0 + gap * gap)
    return total
