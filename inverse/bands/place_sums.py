"""Normal equations of a box's geometry and of the places of rows, compiled."""

import numpy as np
from numba import njit

from inverse.bands.band_arrivals import (
    BITS,
    add_arrivals,
    bounce,
    folded,
    heard_arrivals,
    place_arrivals,
    planar,
)
from inverse.bands.band_kernel import list_images
from inverse.bands.band_sums import continued, left_of
from inverse.paths.lattice_kernel import _path_slopes

__all__ = ["accumulate_places"]

COLUMNS = 17


@njit(cache=True, fastmath=True)
def _delays(found, away, lattice, about_e, about_h, scale, speed, rate, moved):
    """Write how images' arrivals follow each column, samples, (images, COLUMNS)."""
    parity, sign = np.empty(3), np.empty(3)
    for n in range(found):
        length = away[n, 3]
        for axis in range(3):
            sign[axis] = lattice[n, 3 + axis]
            parity[axis] = 0.5 - 0.5 * sign[axis]
            moved[n, 11 + axis] = away[n, axis] / length * scale
            moved[n, 14 + axis] = -sign[axis] * away[n, axis] / length * scale
        _path_slopes(
            away[n], length, lattice[n], parity, sign, about_e, about_h, moved[n]
        )
        for k in range(9):
            moved[n, k] *= scale
        moved[n, 9] = -length * rate / (speed * speed)
        moved[n, 10] = 1.0


@njit(cache=True, fastmath=True)
def _spread(found, values, moved, places, parts, taps, width, jacobian):
    """Add how an envelope follows each column, shape (size, 2 COLUMNS)."""
    for n in range(found):
        start, step, part = places[n, 0], places[n, 1], parts[n]
        real, imag = values[n].real, values[n].imag
        low, high, mine = taps[step], taps[step + 1], moved[n]
        for tap in range(width):
            a = low[0, tap] + part * (high[0, tap] - low[0, tap])
            b = low[1, tap] + part * (high[1, tap] - low[1, tap])
            first, second = a * real - b * imag, a * imag + b * real
            row = jacobian[start + tap]
            for k in range(COLUMNS):
                row[k] += first * mine[k]
                row[COLUMNS + k] += second * mine[k]


@njit(cache=True, fastmath=True)
def _curved(jacobian, live, weight, square):
    size = len(live)
    for m in range(size, len(jacobian)):
        jacobian[m % size] += jacobian[m]
    for m in range(size):
        if not live[m]:
            jacobian[m] = 0.0
    used = jacobian[:size]
    both = np.dot(used.T, used)
    for i in range(COLUMNS):
        for j in range(COLUMNS):
            square[i, j] += weight * (both[i, j] + both[COLUMNS + i, COLUMNS + j])


@njit(cache=True, fastmath=True)
def accumulate_places(
    emitters, listeners, turns, hearing, low, high, scale, latency, reach, walls,
    angled, loss, emitting, listening, least, most, starts, lengths, turn, rates, taps,
    widths, slopes, room_for, live, chosen, curved, sloped, center, speed, rate,
    targets, weights, square, right, misfit,
):  # fmt: skip
    """Add up each row's normal equations of geometry and both its places.

    Columns: turn 3, low 3, high 3, speed, latency (samples), listener 3, emitter 3,
    in the frame of the box. `square` (rows, 17, 17), filled where `curved`, `right`
    (rows, 17), where `sloped`, and `misfit` (rows,) are sums over the `chosen` bands.
    """
    away, lattice = np.empty((room_for, 4)), np.empty((room_for, 6))
    counts = np.empty((room_for, 6), dtype=np.int64)
    leaving = np.empty((room_for, emitting.shape[1]))
    arriving = np.empty((room_for, listening.shape[1]))
    cosines, bounces = np.empty((3, room_for)), np.empty((3, 2 + BITS, room_for))
    mirrored, values = np.empty((4, room_for)), np.empty(room_for, dtype=np.complex128)
    echoes, along = np.empty(room_for, dtype=np.complex128), np.empty(room_for)
    places, parts = np.empty((room_for, 2), dtype=np.int64), np.empty(room_for)
    fractions = taps.shape[1] - 1
    shapes, wide = planar(taps, widths)
    tilts, _ = planar(slopes, widths)
    spare = shapes.shape[3]
    longest = lengths.max() + spare
    moved = np.empty((room_for, COLUMNS))
    every, both = np.empty((longest, 2 * COLUMNS)), np.empty((2, longest))
    square[:], right[:], misfit[:] = 0.0, 0.0, 0.0
    for row in range(len(emitters)):
        found = list_images(
            emitters[row] - low, listeners[row] - low, turns[row], hearing[row], low,
            high, reach, least, most, away, lattice, counts, leaving, arriving,
        )  # fmt: skip
        bits = bounce(found, away, counts, cosines, bounces)
        if curved or sloped:
            _delays(
                found, away, lattice, emitters[row] - center, listeners[row] - center,
                scale, speed, rate, moved,
            )  # fmt: skip
        along[:found] = 0.0
        for band in range(len(starts)):
            if not chosen[band]:
                continue
            size = lengths[band]
            place_arrivals(
                found, away, cosines, bounces, bits, walls[band], angled, loss[band],
                scale, latency, turn[band], rates[band], size, widths[band] // 2 - 1,
                fractions, mirrored, values, places, parts,
            )  # fmt: skip
            leave = np.dot(leaving[:found], emitting[band])
            arrive = np.dot(arriving[:found], listening[band])
            for n in range(found):
                values[n] *= leave[n] * arrive[n]
            model = both[:, : size + spare]
            model[:] = 0.0
            add_arrivals(found, values, places, parts, shapes[band], wide[band], model)
            folded(model, size)
            here = slice(starts[band], starts[band] + size)
            weight = weights[row, band]
            misfit[row] += weight * left_of(live[here], targets[row, here], model)
            if sloped:
                continued(model, size)
                heard_arrivals(
                    found, places, parts, tilts[band], wide[band], model, echoes
                )
                for n in range(found):
                    along[n] += weight * (values[n].conjugate() * echoes[n]).real
            if curved:
                jacobian = every[: size + spare]
                jacobian[:] = 0.0
                _spread(
                    found, values, moved, places, parts, tilts[band], wide[band],
                    jacobian,
                )  # fmt: skip
                _curved(jacobian, live[here], weight, square[row])
        if sloped:
            right[row] = np.dot(along[:found], moved[:found])
