"""Sound by way of small objects in a box, compiled.

From either end to a point and on to the other, each leg over at most one wall: 7 x 7
paths a point. A leg is a number a band, so a path costs one product.
"""

from math import sqrt

import numpy as np
from numba import njit

from inverse.bands.band_kernel import _dot
from rir.harmonics_kernel import order_of, turned_harmonics

__all__ = ["add_points", "sum_points"]

LEGS, NEAREST_M = 7, 0.1


@njit(cache=True, fastmath=True)
def _lengths(end, point, low, high, away, lengths):
    """Write the ways from an end to a point; 0 direct, then low x, high x, ..."""
    for leg in range(LEGS):
        square = 0.0
        for axis in range(3):
            step = point[axis] - end[axis]
            if leg > 0 and (leg - 1) // 2 == axis:
                wall = low[axis] if (leg - 1) % 2 == 0 else high[axis]
                step = 2.0 * wall - point[axis] - end[axis]
            away[leg, axis] = step
            square += step * step
        lengths[leg] = max(sqrt(square), NEAREST_M)


@njit(cache=True, fastmath=True)
def _faced(turn, away, length, order, basis):
    x, y, z = away[0] / length, away[1] / length, away[2] / length
    turned_harmonics(turn, x, y, z, order, basis)


@njit(cache=True, fastmath=True)
def _factor(walls, angled, away, length, leg):
    """Return what the wall of a leg leaves in one band."""
    if leg == 0:
        return 1.0 + 0.0j
    one = walls[leg - 1]
    if angled:
        cosine = abs(away[(leg - 1) // 2]) / length
        one = (cosine - one) / (cosine + one)
    return one


@njit(cache=True, fastmath=True)
def add_points(
    emitters, listeners, turns, hearing, low, high, scale, latency, reach, walls,
    angled, loss, emitting, listening, points, gains, starts, sizes, turn, rates, taps,
    widths, out,
):  # fmt: skip
    """Add what points scatter to envelopes, shape (rows, total).

    `points` (points, 3) stand in the frame of the box as ends do, `gains` (bands,
    points) are amplitudes of a point at 1 m from both ends.
    """
    away, lengths = np.empty((2, LEGS, 3)), np.empty((2, LEGS))
    leaving = np.empty((LEGS, emitting.shape[1]))
    arriving = np.empty((LEGS, listening.shape[1]))
    said, heard = order_of(emitting.shape[1]), order_of(listening.shape[1])
    first = np.empty(LEGS, dtype=np.complex128)
    second = np.empty(LEGS, dtype=np.complex128)
    fractions = taps.shape[1] - 1
    for row in range(len(emitters)):
        for n in range(len(points)):
            _lengths(emitters[row], points[n], low, high, away[0], lengths[0])
            _lengths(listeners[row], points[n], low, high, away[1], lengths[1])
            for leg in range(LEGS):
                _faced(turns[row], away[0, leg], lengths[0, leg], said, leaving[leg])
                _faced(
                    hearing[row], away[1, leg], lengths[1, leg], heard, arriving[leg]
                )
            for band in range(len(starts)):
                gain = gains[band, n]
                if gain == 0.0:
                    continue
                angle = turn[band] * latency
                gain *= complex(np.cos(angle), -np.sin(angle))
                for leg in range(LEGS):
                    length = lengths[0, leg]
                    bare = np.exp(-loss[band] * length) / length
                    bare *= _dot(emitting[band], leaving[leg])
                    angle = turn[band] * length * scale
                    first[leg] = bare * complex(np.cos(angle), -np.sin(angle))
                    first[leg] *= gain * _factor(
                        walls[band], angled, away[0, leg], length, leg
                    )
                    length = lengths[1, leg]
                    bare = np.exp(-loss[band] * length) / length
                    bare *= _dot(listening[band], arriving[leg])
                    angle = turn[band] * length * scale
                    second[leg] = bare * complex(np.cos(angle), -np.sin(angle))
                    second[leg] *= _factor(
                        walls[band], angled, away[1, leg], length, leg
                    )
                width = widths[band]
                lead = width // 2 - 1
                here = out[row, starts[band] : starts[band] + sizes[band]]
                for one in range(LEGS):
                    for other in range(LEGS):
                        length = lengths[0, one] + lengths[1, other]
                        if length > reach:
                            continue
                        value = first[one] * second[other]
                        place = (length * scale + latency) * rates[band]
                        base = int(np.floor(place))
                        fine = (place - base) * fractions
                        step = int(fine)
                        part = fine - step
                        m = (base - lead) % sizes[band]
                        for tap in range(width):
                            shape = taps[band, step, tap]
                            shape += part * (taps[band, step + 1, tap] - shape)
                            here[m] += value * shape
                            m += 1
                            if m == sizes[band]:
                                m = 0


@njit(cache=True, fastmath=True)
def _gains(end, turn, point, low, high, walls, angled, pattern, away, lengths, gains):
    """Write what each leg of an end has of amplitude, at one frequency."""
    _lengths(end, point, low, high, away, lengths)
    for leg in range(LEGS):
        gain = pattern[0]
        if len(pattern) > 1:
            # harmonics of first order: y, z, x of the device
            for axis in range(3):
                along = turn[axis, 0] * away[leg, 0] + turn[axis, 1] * away[leg, 1]
                along = (along + turn[axis, 2] * away[leg, 2]) / lengths[leg]
                gain += pattern[1 + (axis + 2) % 3] * along
        gains[leg] = gain / lengths[leg]
        gains[leg] *= _factor(walls, angled, away[leg], lengths[leg], leg)


@njit(cache=True, fastmath=True)
def sum_points(
    emitters, listeners, turns, hearing, low, high, scale, latency, reach, walls,
    angled, emitting, listening, points, signals, step, sums, norms,
):  # fmt: skip
    """Sum signals along all paths by way of each point.

    Parameters
    ----------
    walls : ndarray, shape (6,)
        Of one band.
    emitting, listening : ndarray, shape (1,) or (4,)
        Gains of constant and y, z, x directions.
    points : ndarray, shape (points, 3)
    signals : ndarray, shape (rows, times)
        Analytic, filtered as an arrival is, `step` a sample.
    sums, norms : ndarray
        Filled, shape (points,): complex agreement and energy of the paths.
    """
    away, lengths = np.empty((2, LEGS, 3)), np.empty((2, LEGS))
    first = np.empty(LEGS, dtype=np.complex128)
    second = np.empty(LEGS, dtype=np.complex128)
    most = signals.shape[1] - 1
    for n in range(len(points)):
        total, norm = 0.0 + 0.0j, 0.0
        for row in range(len(emitters)):
            _gains(
                emitters[row], turns[row], points[n], low, high, walls, angled,
                emitting, away[0], lengths[0], first,
            )  # fmt: skip
            _gains(
                listeners[row], hearing[row], points[n], low, high, walls, angled,
                listening, away[1], lengths[1], second,
            )  # fmt: skip
            for one in range(LEGS):
                for other in range(LEGS):
                    length = lengths[0, one] + lengths[1, other]
                    if length > reach:
                        continue
                    place = (length * scale + latency) * step
                    base = int(place)
                    if base >= most:
                        continue
                    part = place - base
                    value = first[one] * second[other]
                    near, far = signals[row, base], signals[row, base + 1]
                    heard = near + part * (far - near)
                    total += value.conjugate() * heard
                    norm += value.real**2 + value.imag**2
        sums[n], norms[n] = total, norm
