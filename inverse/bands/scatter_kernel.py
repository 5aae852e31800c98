"""Sound by way of small objects in a box, compiled.

From either end to a point and on to the other, each leg over at most one wall: 7 x 7
paths a point. A leg is a number a band, so a path costs one product.
"""

from math import sqrt

import numpy as np
from numba import njit

from inverse.bands.band_arrivals import paint, reflected
from inverse.bands.band_kernel import pattern_gain
from rir.harmonics_kernel import order_of, turned_harmonics

__all__ = ["add_points", "sum_points"]

LEGS = 7  # direct, or over one of six walls
NEAREST_M = 0.1  # an object is no point from nearer


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
    cosine = abs(away[(leg - 1) // 2]) / length
    return reflected(walls[leg - 1], angled, cosine)


@njit(cache=True, fastmath=True)
def _sent(band, leg, pattern, lengths, basis, scale, interior, kernels):
    """Return what one leg of an end has of amplitude and phase in one band."""
    length = lengths[leg]
    bare = np.exp(-interior.loss[band] * length) / length
    bare *= pattern_gain(pattern[band], basis[leg])
    angle = kernels.turns[band] * length * scale
    return bare * complex(np.cos(angle), -np.sin(angle))


@njit(cache=True, fastmath=True)
def add_points(ends, geometry, interior, kernels, points, gains, out):
    """Add what points scatter to envelopes, shape (rows, total).

    `points` (points, 3) stand in the frame of the box as ends do, `gains` (bands,
    points) are amplitudes of a point at 1 m from both ends. Other parameters are
    those of `inverse.bands.band_kernel`.
    """
    emitters, listeners, turns, hearing = ends
    low, high, scale, latency, reach = geometry
    emitting, listening = interior.emitting, interior.listening
    away, lengths = np.empty((2, LEGS, 3)), np.empty((2, LEGS))
    leaving = np.empty((LEGS, emitting.shape[1]))
    arriving = np.empty((LEGS, listening.shape[1]))
    orders = order_of(emitting.shape[1]), order_of(listening.shape[1])
    first = np.empty(LEGS, dtype=np.complex128)
    second = np.empty(LEGS, dtype=np.complex128)
    for row in range(len(out)):
        for n in range(len(points)):
            _lengths(emitters[row], points[n], low, high, away[0], lengths[0])
            _lengths(listeners[row], points[n], low, high, away[1], lengths[1])
            for leg in range(LEGS):
                length = lengths[0, leg]
                _faced(turns[row], away[0, leg], length, orders[0], leaving[leg])
                length = lengths[1, leg]
                _faced(hearing[row], away[1, leg], length, orders[1], arriving[leg])
            for band in range(len(kernels.starts)):
                gain = gains[band, n]
                if gain == 0.0:
                    continue
                angle = kernels.turns[band] * latency
                gain *= complex(np.cos(angle), -np.sin(angle))
                walls, angled = interior.walls[band], interior.angled
                for leg in range(LEGS):
                    first[leg] = _sent(
                        band, leg, emitting, lengths[0], leaving, scale,
                        interior, kernels,
                    )  # fmt: skip
                    first[leg] *= gain * _factor(
                        walls, angled, away[0, leg], lengths[0, leg], leg
                    )
                    second[leg] = _sent(
                        band, leg, listening, lengths[1], arriving, scale,
                        interior, kernels,
                    )  # fmt: skip
                    second[leg] *= _factor(
                        walls, angled, away[1, leg], lengths[1, leg], leg
                    )
                start, size = kernels.starts[band], kernels.lengths[band]
                here = out[row, start : start + size]
                for one in range(LEGS):
                    for other in range(LEGS):
                        length = lengths[0, one] + lengths[1, other]
                        if length <= reach:
                            at = length * scale + latency
                            value = first[one] * second[other]
                            paint(value, at, band, kernels, size, here)


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
    ends, geometry, walls, angled, emitting, listening, points, signals, step, sums,
    norms,
):  # fmt: skip
    """Sum signals along all paths by way of each point.

    Parameters
    ----------
    ends, geometry
        As in `inverse.bands.band_kernel`.
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
    emitters, listeners, turns, hearing = ends
    low, high, scale, latency, reach = geometry
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
                    total += value.conjugate() * (near + part * (far - near))
                    norm += value.real**2 + value.imag**2
        sums[n], norms[n] = total, norm
