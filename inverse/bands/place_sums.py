"""Normal equations of a box's geometry and of the places of rows, compiled."""

import numpy as np
from numba import njit

from inverse.bands.band_arrivals import (
    arrival_arrays,
    bounce,
    held_arrivals,
    place_arrivals,
    planar,
    summed_arrivals,
)
from inverse.bands.band_kernel import image_arrays, list_images, pattern_gains
from inverse.bands.band_sums import residual_of
from inverse.paths.lattice_kernel import GEOMETRY, path_slopes

__all__ = ["accumulate_places"]

COLUMNS = GEOMETRY + 6
"""Both places, three coordinates each, behind the geometry."""


@njit(cache=True, fastmath=True)
def _delays(found, row, ends, geometry, images, center, speed, rate, moved):
    """Write how images' arrivals follow each column, samples, (images, COLUMNS)."""
    away, lattice, scale = images[0], images[1], geometry[2]
    about_e, about_h = ends[0][row] - center, ends[1][row] - center
    parity, sign = np.empty(3), np.empty(3)
    for n in range(found):
        length = away[n, 3]
        for axis in range(3):
            sign[axis] = lattice[n, 3 + axis]
            parity[axis] = 0.5 - 0.5 * sign[axis]
            moved[n, 11 + axis] = away[n, axis] / length * scale
            moved[n, 14 + axis] = -sign[axis] * away[n, axis] / length * scale
        path_slopes(
            away[n], length, lattice[n], parity, sign, about_e, about_h, moved[n]
        )
        for k in range(9):
            moved[n, k] *= scale
        moved[n, 9] = -length * rate / (speed * speed)
        moved[n, 10] = 1.0


@njit(cache=True, fastmath=True)
def _spread(found, arrivals, moved, taps, width, jacobian):
    """Add how an envelope follows each column, shape (size, 2 COLUMNS)."""
    values, places, parts = arrivals[3], arrivals[4], arrivals[5]
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
    ends, geometry, interior, kernels, room_for, live, chosen, curved, sloped, center,
    speed, rate, targets, weights, square, right, misfit,
):  # fmt: skip
    """Add up each row's normal equations of geometry and both its places.

    Columns: turn 3, low 3, high 3, speed, latency (samples), listener 3, emitter 3,
    in the frame of the box. `square` (rows, 17, 17), filled where `curved`, `right`
    (rows, 17), where `sloped`, and `misfit` (rows,) are sums over the `chosen` bands.
    Other parameters are those of `inverse.bands.band_sums.accumulate_bands`.
    """
    images = image_arrays(
        room_for, interior.emitting.shape[1], interior.listening.shape[1]
    )
    arrivals = arrival_arrays(room_for)
    values = arrivals[3]
    echoes, along = np.empty(room_for, dtype=np.complex128), np.empty(room_for)
    shapes, wide = planar(kernels.taps, kernels.widths)
    tilts, _ = planar(kernels.slopes, kernels.widths)
    spare = shapes.shape[3]
    longest = kernels.lengths.max() + spare
    moved = np.empty((room_for, COLUMNS))
    every, both = np.empty((longest, 2 * COLUMNS)), np.empty((2, longest))
    square[:], right[:], misfit[:] = 0.0, 0.0, 0.0
    for row in range(len(targets)):
        found = list_images(row, ends, geometry, interior.least, interior.order, images)
        bits = bounce(found, images, arrivals)
        if curved or sloped:
            _delays(found, row, ends, geometry, images, center, speed, rate, moved)
        along[:found] = 0.0
        for band in range(len(kernels.starts)):
            if not chosen[band]:
                continue
            size, start = kernels.lengths[band], kernels.starts[band]
            place_arrivals(
                found, bits, band, images, geometry, interior, kernels, arrivals
            )
            leave, arrive = pattern_gains(found, band, images, interior)
            for n in range(found):
                values[n] *= leave[n] * arrive[n]
            model = both[:, : size + spare]
            summed_arrivals(found, arrivals, shapes[band], wide[band], size, model)
            here = slice(start, start + size)
            weight = weights[row, band]
            misfit[row] += weight * residual_of(live[here], targets[row, here], model)
            if sloped:
                held_arrivals(
                    found, arrivals, tilts[band], wide[band], size, 1.0, model, echoes
                )
                for n in range(found):
                    along[n] += weight * (values[n].conjugate() * echoes[n]).real
            if curved:
                jacobian = every[: size + spare]
                jacobian[:] = 0.0
                _spread(found, arrivals, moved, tilts[band], wide[band], jacobian)
                _curved(jacobian, live[here], weight, square[row])
        if sloped:
            right[row] = np.dot(along[:found], moved[:found])
