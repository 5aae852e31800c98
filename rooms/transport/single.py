"""Compiled: energy scattered once, and otherwise straight or mirrored close by.

Smooth functions are too wide for it where a place is close to a wall. So the points
that the rays of either place meet are joined to the other place, each counted for the
share that its own rays have of all that arrive there from both (balance heuristic,
E. Veach, PhD thesis, Stanford University, 1997, chapter 9): no place is too close.

Mirrored close by is what met the nearest wall of another axis first, once at most:
where two walls meet, these images are as near as the place itself. A hit has a class:
bit 0 is set if the axis after that of its wall was mirrored, bit 1 if the next one.
"""

import numpy as np
from numba import njit

__all__ = ["CLASSES", "collect_hits", "density", "deposit_hits", "join_hits"]

CLASSES = 4  # mirrored or not at the nearest wall of each of the two other axes
_CLOSEST = 1e-6
"""Least distance from a wall [m]: all that a place on a wall sends there stays."""


@njit(cache=True, nogil=True, error_model="numpy")
def density(size, place, nearest, mirrors, wall, point, parts):
    """Write what arrives at a point of a wall from a place and its close images.

    Cosine over 4 pi times the square of the distance, per class; nothing is absorbed.
    """
    axis = wall // 2
    one, other = (axis + 1) % 3, (axis + 2) % 3
    high = max(abs(point[axis] - place[axis]), _CLOSEST)
    a = place[one] - point[one]
    b = place[other] - point[other]
    c = 2.0 * nearest[one] * size[one] - place[one] - point[one]
    d = 2.0 * nearest[other] * size[other] - place[other] - point[other]
    straight, up = a * a, high * high
    mirrored, side, far = c * c, up + b * b, up + d * d
    parts[1, 0], parts[1, 1] = side + straight, side + mirrored
    parts[1, 2], parts[1, 3] = far + straight, far + mirrored
    for k in range(4):
        square = parts[1, k]
        parts[1, k] = np.sqrt(square)
        parts[0, k] = high / (4.0 * np.pi * square * parts[1, k])
    if not mirrors[2 * one + nearest[one]]:
        parts[0, 1] = parts[0, 3] = 0.0
    if not mirrors[2 * other + nearest[other]]:
        parts[0, 2] = parts[0, 3] = 0.0
    return parts[0, 0] + parts[0, 1] + parts[0, 2] + parts[0, 3]


@njit(cache=True, nogil=True, error_model="numpy")
def collect_hits(size, place, nearest, mirrors, rays, whole, points, values):
    """Follow rays while they are straight or mirrored close by; return how many hit.

    Parameters
    ----------
    size, place : ndarray, shape (3,)
        Lengths of the box, and the place [m].
    nearest : ndarray of int, shape (3,)
        0 or 1: which wall of each axis is the nearer.
    mirrors : ndarray of bool, shape (6,)
        Which walls mirror anything.
    rays : tuple (ways, weights)
        Directions, shape (rays, 3), and weights that add to one.
    whole : ndarray of int, shape (3 * rays, 2)
        Gets wall and class.
    points : ndarray, shape (3 * rays, 3)
        Gets the points.
    values : ndarray, shape (3 * rays, 3)
        Gets the way gone [m], the density there, see `join_hits`, and the weight.
    """
    ways, weights = rays
    count = 0
    at, until = np.empty(3), np.empty(3)
    met, side = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
    parts = np.empty((2, 4))
    for r in range(len(ways)):
        for k in range(3):
            speed = abs(ways[r, k])
            side[k] = 1 if ways[r, k] > 0.0 else 0
            gap = size[k] - place[k] if side[k] == 1 else place[k]
            until[k] = gap / speed if speed > 1e-12 else 1e30
            met[k] = 0
        for _ in range(3):
            axis = 0 if until[0] <= until[1] else 1
            axis = axis if until[axis] <= until[2] else 2
            if met[axis]:
                break
            way = until[axis]
            for k in range(3):
                at[k] = place[k] + way * ways[r, k]
                if met[k]:
                    at[k] = 2.0 * nearest[k] * size[k] - at[k]
                at[k] = min(max(at[k], 0.0), size[k])
            wall = 2 * axis + side[axis]
            at[axis] = side[axis] * size[axis]
            points[count] = at
            whole[count, 0] = wall
            whole[count, 1] = met[(axis + 1) % 3] + 2 * met[(axis + 2) % 3]
            values[count, 0] = way
            values[count, 1] = density(size, place, nearest, mirrors, wall, at, parts)
            values[count, 2] = weights[r]
            count += 1
            if side[axis] != nearest[axis] or not mirrors[wall]:
                break
            met[axis] = 1
            until[axis] += size[axis] / abs(ways[r, axis])
            side[axis] = 1 - side[axis]
    return count


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def deposit_hits(size, hits, factors, functions, per_bin, out):
    """Add hits to moments over time, as `rooms.transport.tracing.follow` does.

    Parameters
    ----------
    hits : tuple (whole, points, values)
        See `collect_hits`.
    factors : ndarray, shape (6, classes, lanes)
        What a hit leaves.
    functions, per_bin, out
        See `rooms.transport.tracing.follow`; one source.
    """
    whole, points, values = hits
    degrees, starts, scale = functions
    steps, lanes = out.shape[0], factors.shape[2]
    highest = 0
    for n in range(len(degrees)):
        highest = max(highest, degrees[n, 0], degrees[n, 1])
    one, other = np.ones(highest + 2), np.ones(highest + 2)
    for h in range(len(whole)):
        wall, kind = whole[h, 0], whole[h, 1]
        axis = wall // 2
        u, v = (axis + 1) % 3, (axis + 2) % 3
        x = 2.0 * points[h, u] / size[u] - 1.0
        y = 2.0 * points[h, v] / size[v] - 1.0
        one[1], other[1] = x, y
        for n in range(1, highest):
            one[n + 1] = ((2 * n + 1) * x * one[n] - n * one[n - 1]) / (n + 1)
            other[n + 1] = ((2 * n + 1) * y * other[n] - n * other[n - 1]) / (n + 1)
        middle = int(values[h, 0] * per_bin + 0.5)
        if middle + 2 >= steps:
            continue
        f = values[h, 0] * per_bin - middle
        for n in range(starts[wall], starts[wall + 1]):
            value = scale[n] * one[degrees[n, 0]] * other[degrees[n, 1]]
            value *= values[h, 2]
            for step in range(-1, 2):
                share = 1.0 - f * f if step == 0 else 0.5 * f * (f + step)
                row = middle + step
                row = steps - 1 if row < 0 else row
                for lane in range(lanes):
                    more = share * value * factors[wall, kind, lane]
                    out[row, n * lanes + lane] += more


@njit(cache=True, nogil=True, error_model="numpy")
def join_hits(size, hits, kept, there, factors, per_bin, out):
    """Join the hits of one place to another.

    Parameters
    ----------
    hits, kept : tuple (whole, points, values), ndarray of shape (6, classes, lanes)
        Of the one place, see `collect_hits`, and what close mirrors leave of each.
    there : tuple (place, nearest, kept, mirrors)
        The other place, and as in `collect_hits`.
    factors : ndarray, shape (6, lanes)
        What walls scatter of it.
    per_bin : float
        Time steps per metre.
    out : ndarray, shape (steps, lanes)
        Gets the density of the other's class, weighed.
    """
    whole, points, values = hits
    place, nearest, kept_there, mirrors = there
    steps, lanes = out.shape
    parts = np.empty((2, 4))
    for h in range(len(whole)):
        wall, kind = whole[h, 0], whole[h, 1]
        total = density(size, place, nearest, mirrors, wall, points[h], parts)
        own = values[h, 2] * values[h, 1] / (values[h, 1] + total)
        for k in range(4):
            step = int((values[h, 0] + parts[1, k]) * per_bin)
            if step >= steps or parts[0, k] == 0.0:
                continue
            more = parts[0, k] * own
            for lane in range(lanes):
                both = kept[wall, kind, lane] * kept_there[wall, k, lane]
                out[step, lane] += more * both * factors[wall, lane]
