"""Sum responses along the reflections of planes, compiled."""

from math import sqrt

import numpy as np
from numba import njit

__all__ = ["scan_grid", "sum_planes"]


@njit(cache=True, fastmath=True)
def scan_grid(
    signals, emitters, listeners, groups, weights, normals, nearest, step, out
):
    """Score planes on a grid of normals and offsets.

    Parameters
    ----------
    signals : ndarray of float32, shape (rows, m)
        Responses times path length, one sample per metre of `1 / m_per_sample`;
        the last sample must be 0.
    emitters, listeners : ndarray, shape (rows, 3)
        In units of the samples of `signals`.
    groups : ndarray of int, shape (rows,)
        Group of emitters of each row.
    weights : ndarray, shape (groups,)
        What makes the sum of a group a z-score.
    normals : ndarray, shape (K, 3)
        Unit vectors into the room.
    nearest : ndarray, shape (K,)
        Offset of the first plane along each normal, same unit.
    step : float
        Distance between planes, same unit.
    out : ndarray, shape (K, D)
        Filled with (sum of z - largest z) / sqrt(groups - 1): one emitter alone
        must not make a wall.
    """
    rows, last = signals.shape[0], signals.shape[1] - 1
    count, depth = out.shape
    held = np.zeros((len(weights), depth), np.float32)
    square = np.empty(rows)
    for row in range(rows):
        total = 0.0
        for axis in range(3):
            gap = emitters[row, axis] - listeners[row, axis]
            total += gap * gap
        square[row] = total
    for k in range(count):
        held[:] = 0.0
        for row in range(rows):
            a = -nearest[k]
            b = -nearest[k]
            for axis in range(3):
                a += normals[k, axis] * emitters[row, axis]
                b += normals[k, axis] * listeners[row, axis]
            mine = held[groups[row]]
            signal = signals[row]
            straight = square[row]
            for j in range(depth):
                far = j * step
                length = sqrt(straight + 4.0 * (a + far) * (b + far))
                mine[j] += signal[min(int(length + 0.5), last)]
        _balance(held, weights, out[k])


@njit(cache=True, fastmath=True)
def _balance(held, weights, out):
    groups, depth = held.shape
    for j in range(depth):
        total, most = 0.0, -1e30
        for group in range(groups):
            value = held[group, j] * weights[group]
            total += value
            most = max(most, value)
        out[j] = total if groups == 1 else (total - most) / sqrt(groups - 1.0)


@njit(cache=True, fastmath=True)
def sum_planes(signals, emitters, listeners, groups, planes, shifts, sums, counts):
    """Sum each group's signals at the reflections of given planes.

    Parameters
    ----------
    signals, emitters, listeners, groups
        As in `scan_grid`.
    planes : ndarray, shape (K, 4)
        Normal and offset d, n . p - d > 0 inside; same unit.
    shifts : ndarray, shape (S,)
        Added to every path, same unit; other than 0 they make the null.
    sums, counts : ndarray, shape (K, groups, S) and (K, groups)
        Filled with sums, linearly interpolated, and rows in front of the plane.
    """
    rows, size = signals.shape
    sums[:] = 0.0
    counts[:] = 0.0
    for k in range(len(planes)):
        for row in range(rows):
            a, b, straight = -planes[k, 3], -planes[k, 3], 0.0
            for axis in range(3):
                a += planes[k, axis] * emitters[row, axis]
                b += planes[k, axis] * listeners[row, axis]
                gap = emitters[row, axis] - listeners[row, axis]
                straight += gap * gap
            if a <= 0.0 or b <= 0.0:
                continue
            length = sqrt(straight + 4.0 * a * b)
            if length >= size - 2:
                continue
            group = groups[row]
            counts[k, group] += 1.0
            for s in range(len(shifts)):
                at = length + shifts[s]
                if at < 0.0 or at >= size - 2:
                    continue
                low = int(at)
                part = at - low
                sums[k, group, s] += (1.0 - part) * signals[row, low]
                sums[k, group, s] += part * signals[row, low + 1]
