"""Compiled: follow rays from wall to wall of a box by mirrors only."""

import numpy as np
from numba import njit

__all__ = ["follow"]

_FAINT = 1e-8
"""Share of a ray's energy below which it is followed no further (-80 dB)."""

_FEWER = 4
"""One ray of four goes on for all of them whenever they have lost 12 dB: work follows
the root of the energy."""


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def follow(size, rays, emitted, first, shares, functions, per_bin, hits, out):
    """Add what rays leave on the walls to moments over time.

    A ray that meets a wall leaves there what it carries times the wall's share, as the
    wall's functions at that point; its mirrored part goes on. A time between steps is
    spread over the three nearest, so that its moments to the second are kept.

    Parameters
    ----------
    size : ndarray, shape (3,)
        Lengths of the box [m].
    rays : tuple of ndarray, shape (rays, 3)
        Starts [m] and directions.
    emitted : ndarray, shape (rays, sources)
        What a ray carries of each source.
    first : ndarray, shape (lanes,)
        Factor of all rays.
    shares : tuple of ndarray, shape (6, lanes)
        What walls mirror and what counts of all that meets them.
    functions : tuple (degrees, starts, scale)
        See `rooms.transport.functions.WallFunctions`.
    per_bin : float
        Time steps per metre.
    hits : int
        So many walls are met at most.
    out : ndarray, shape (steps, sources, functions * lanes)
        Gets the sums. The last step is the one before zero.
    """
    origins, ways = rays
    mirrored, gate = shares
    degrees, starts, scale = functions
    steps, sources, _ = out.shape
    lanes = len(first)
    highest = 0
    for n in range(len(degrees)):
        highest = max(highest, degrees[n, 0], degrees[n, 1])
    one, other = np.ones(highest + 2), np.ones(highest + 2)
    left, values = np.empty(lanes), np.empty((len(scale)) * lanes)
    until, every = np.empty(3), np.empty(3)
    side = np.empty(3, dtype=np.int64)
    farthest = (steps - 2.5) / per_bin
    for r in range(len(ways)):
        for k in range(3):
            speed = abs(ways[r, k])
            side[k] = 1 if ways[r, k] > 0.0 else 0
            gap = size[k] - origins[r, k] if side[k] == 1 else origins[r, k]
            until[k] = gap / speed if speed > 1e-12 else 1e30
            every[k] = size[k] / speed if speed > 1e-12 else 1e30
        faint, weight, group = 0.0, 1.0, 1
        for lane in range(lanes):
            left[lane] = first[lane]
            faint = max(faint, _FAINT * first[lane])
        fewer = faint / _FAINT / (_FEWER * _FEWER)
        for _ in range(hits):
            axis = 0 if until[0] <= until[1] else 1
            axis = axis if until[axis] <= until[2] else 2
            way = until[axis]
            if way > farthest:
                break
            wall = 2 * axis + side[axis]
            u, v = (axis + 1) % 3, (axis + 2) % 3
            # how far along: what is left of the way to the next wall of that axis
            x = (until[u] - way) / every[u] if every[u] < 1e29 else 0.5
            y = (until[v] - way) / every[v] if every[v] < 1e29 else 0.5
            if every[u] >= 1e29:
                x = origins[r, u] / size[u]
                x = 1.0 - x if side[u] == 1 else x
            if every[v] >= 1e29:
                y = origins[r, v] / size[v]
                y = 1.0 - y if side[v] == 1 else y
            x = 1.0 - 2.0 * x if side[u] == 1 else 2.0 * x - 1.0
            y = 1.0 - 2.0 * y if side[v] == 1 else 2.0 * y - 1.0
            one[1], other[1] = x, y
            for n in range(1, highest):
                one[n + 1] = ((2 * n + 1) * x * one[n] - n * one[n - 1]) / (n + 1)
                other[n + 1] = ((2 * n + 1) * y * other[n] - n * other[n - 1]) / (n + 1)
            low, high = starts[wall], starts[wall + 1]
            at = 0
            for n in range(low, high):
                value = scale[n] * one[degrees[n, 0]] * other[degrees[n, 1]]
                for lane in range(lanes):
                    values[at] = value * left[lane] * gate[wall, lane]
                    at += 1
            middle = int(way * per_bin + 0.5)
            f = way * per_bin - middle
            for step in range(-1, 2):
                share = 1.0 - f * f if step == 0 else 0.5 * f * (f + step)
                row = middle + step
                row = steps - 1 if row < 0 else row
                for s in range(sources):
                    factor = share * emitted[r, s] * weight
                    target = out[row, s, low * lanes : high * lanes]
                    for n in range(at):
                        target[n] += factor * values[n]
            loudest = 0.0
            for lane in range(lanes):
                left[lane] *= mirrored[wall, lane]
                loudest = max(loudest, left[lane])
            if loudest <= faint:
                break
            while loudest < fewer:
                if (r // group) % _FEWER:
                    break
                weight *= _FEWER
                group *= _FEWER
                fewer /= _FEWER * _FEWER
            if loudest < fewer:
                break
            until[axis] += every[axis]
            side[axis] = 1 - side[axis]
