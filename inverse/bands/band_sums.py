"""Normal equations of what belongs to one half octave only, compiled."""

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
from inverse.bands.band_kernel import (
    LOSS,
    PATTERN,
    PHASE,
    image_arrays,
    list_images,
    pattern_gains,
)

__all__ = ["accumulate_bands", "residual_of"]


@njit(cache=True, fastmath=True)
def residual_of(live, targets, model):
    """Turn a model into its residual; return the squared sum."""
    total = 0.0
    for m in range(len(live)):
        if live[m]:
            model[0, m] = targets[m].real - model[0, m]
            model[1, m] = targets[m].imag - model[1, m]
            total += model[0, m] ** 2 + model[1, m] ** 2
        else:
            model[0, m], model[1, m] = 0.0, 0.0
    return total


@njit(cache=True, fastmath=True)
def _wall_changes(found, band, images, interior, values, changes):
    """Write how images follow the walls of one band, shape (2, images, 6)."""
    away, counts = images[0], images[2]
    for n in range(found):
        for wall in range(6):
            count = counts[n, wall]
            if count == 0:
                changes[0, n, wall], changes[1, n, wall] = 0.0, 0.0
                continue
            below = interior.walls[band, wall]
            above = values[n] * count
            if interior.angled:
                cosine = abs(away[n, wall // 2]) / away[n, 3]
                below = cosine * cosine - below * below
                above *= -2.0 * cosine
            level = 1.0 / (below.real * below.real + below.imag * below.imag)
            changes[0, n, wall] = level * (
                above.real * below.real + above.imag * below.imag
            )
            changes[1, n, wall] = level * (
                above.imag * below.real - above.real * below.imag
            )


@njit(cache=True, fastmath=True)
def _add_turned(row, columns, a, b):
    """Add (a + ib) times complex columns; both halves lie in one row."""
    for k in range(len(row)):
        row[k] += a * columns[0, k] + b * columns[1, k]


@njit(cache=True, fastmath=True)
def _complete(columns):
    """Fill the turned copy of columns whose halves are real and imaginary."""
    count = columns.shape[1] // 2
    for k in range(count):
        columns[1, k] = -columns[0, count + k]
        columns[1, count + k] = columns[0, k]


@njit(cache=True, fastmath=True)
def _spread(found, changes, levels, images, arrivals, taps, width, terms, jacobian):
    """Add the derivatives of all images to those of an envelope, (size, 2 columns).

    Columns: six walls, air, patterns, real parts before imaginary ones; others are
    these turned by a right angle.
    """
    away, leaving, arriving = images[0], images[3], images[4]
    values, places, parts = arrivals[3], arrivals[4], arrivals[5]
    emitting, listening = leaving.shape[1], arriving.shape[1]
    columns = jacobian.shape[1] // 2
    real, imag = terms[0, :columns], terms[0, columns:]
    for n in range(found):
        real[:6], imag[:6] = changes[0, n], changes[1, n]
        whole = values[n]
        real[6], imag[6] = -away[n, 3] * whole.real, -away[n, 3] * whole.imag
        a, b = levels[0, n].real, levels[0, n].imag
        for k in range(emitting):
            real[7 + k], imag[7 + k] = a * leaving[n, k], b * leaving[n, k]
        if listening > 1:
            a, b = levels[1, n].real, levels[1, n].imag
            for k in range(listening):
                real[7 + emitting + k] = a * arriving[n, k]
                imag[7 + emitting + k] = b * arriving[n, k]
        _complete(terms)
        start, step, part = places[n, 0], places[n, 1], parts[n]
        low, high = taps[step], taps[step + 1]
        for tap in range(width):
            a = low[0, tap] + part * (high[0, tap] - low[0, tap])
            b = low[1, tap] + part * (high[1, tap] - low[1, tap])
            _add_turned(jacobian[start + tap], terms, a, b)


@njit(cache=True, fastmath=True)
def _curved(live, jacobian, envelope, weight, whole, square):
    """Add products of all columns to the curvature."""
    size = len(live)
    columns = jacobian.shape[1] // 2
    for m in range(size):
        for half in range(2):
            row = half * size + m
            if not live[m]:
                whole[row] = 0.0
                continue
            turned = 1 - half
            sign = 1.0 if half == 1 else -1.0
            here, beside = half * columns, turned * columns
            for wall in range(6):
                whole[row, 2 * wall] = jacobian[m, here + wall]
                whole[row, 2 * wall + 1] = sign * jacobian[m, beside + wall]
            whole[row, LOSS] = jacobian[m, here + 6]
            whole[row, PHASE] = sign * envelope[turned, m]
            for k in range(columns - 7):
                whole[row, PATTERN + k] = jacobian[m, here + 7 + k]
    used = whole[: 2 * size]
    square += weight * np.dot(used.T, used)


@njit(cache=True, fastmath=True)
def _sloped(found, changes, levels, images, values, echoes, right):
    """Add the residual along all columns; `echoes` is what each image's shape holds."""
    away, leaving, arriving = images[0], images[3], images[4]
    emitting = leaving.shape[1]
    first, second = np.empty(found), np.empty(found)
    for n in range(found):
        echo = echoes[n]
        for wall in range(6):
            a, b = changes[0, n, wall], changes[1, n, wall]
            right[2 * wall] += a * echo.real + b * echo.imag
            right[2 * wall + 1] += a * echo.imag - b * echo.real
        whole = values[n].conjugate() * echo
        right[LOSS] -= away[n, 3] * whole.real
        right[PHASE] += whole.imag
        first[n] = (levels[0, n].conjugate() * echo).real
        second[n] = (levels[1, n].conjugate() * echo).real
    right[PATTERN : PATTERN + emitting] += np.dot(first, leaving[:found])
    if arriving.shape[1] > 1:
        right[PATTERN + emitting :] += np.dot(second, arriving[:found])


@njit(cache=True, fastmath=True)
def accumulate_bands(
    ends, geometry, interior, kernels, room_for, live, chosen, curved, sloped, targets,
    weights, square, right, misfit,
):  # fmt: skip
    """Add up normal equations of every band's walls, air, phase and patterns.

    Parameters
    ----------
    ends, geometry, interior, kernels
        As in `inverse.bands.band_kernel`.
    room_for : int
        Images that arrays are made for.
    live : ndarray of bool, shape (total,)
        Envelope samples that count.
    chosen : ndarray of bool, shape (bands,)
        Bands that are looked at.
    curved, sloped : bool
        Fill `square`; fill `right`. Either costs more than the misfit.
    targets : ndarray, shape (rows, total)
        Complex envelopes.
    weights : ndarray, shape (rows, bands)
        Weight of each squared error.
    square, right, misfit : ndarray
        Filled, shapes (bands, P, P), (bands, P) and (rows, bands).
    """
    emitting, listening = interior.emitting.shape[1], interior.listening.shape[1]
    images = image_arrays(room_for, emitting, listening)
    arrivals = arrival_arrays(room_for)
    values = arrivals[3]
    levels = np.empty((2, room_for), dtype=np.complex128)
    echoes = np.empty(room_for, dtype=np.complex128)
    changes = np.empty((2, room_for, 6))
    shapes, wide = planar(kernels.taps, kernels.widths)
    spare = shapes.shape[3]
    longest = kernels.lengths.max() + spare
    more = listening if listening > 1 else 0
    terms = np.empty((2, 2 * (7 + emitting + more)))
    every = np.empty((longest, 2 * (7 + emitting + more)))
    whole = np.empty((2 * longest, PATTERN + emitting + more))
    both, envelope = np.empty((2, longest)), np.empty((2, longest))
    square[:], right[:], misfit[:] = 0.0, 0.0, 0.0
    for row in range(len(targets)):
        found = list_images(row, ends, geometry, interior.least, interior.order, images)
        bits = bounce(found, images, arrivals)
        for band in range(len(kernels.starts)):
            if not chosen[band]:
                continue
            size, start = kernels.lengths[band], kernels.starts[band]
            place_arrivals(
                found, bits, band, images, geometry, interior, kernels, arrivals
            )
            leave, arrive = pattern_gains(found, band, images, interior)
            for n in range(found):
                levels[0, n], levels[1, n] = values[n] * arrive[n], values[n] * leave[n]
                values[n] *= leave[n] * arrive[n]
            model = both[:, : size + spare]
            summed_arrivals(found, arrivals, shapes[band], wide[band], size, model)
            envelope[:, :size] = model[:, :size]
            here = slice(start, start + size)
            weight = weights[row, band]
            misfit[row, band] = residual_of(live[here], targets[row, here], model)
            if weight == 0.0 or not (curved or sloped):
                continue
            _wall_changes(found, band, images, interior, values, changes)
            if sloped:
                held_arrivals(
                    found, arrivals, shapes[band], wide[band], size, weight, model,
                    echoes,
                )  # fmt: skip
                _sloped(found, changes, levels, images, values, echoes, right[band])
            if curved:
                jacobian = every[: size + spare]
                jacobian[:] = 0.0
                _spread(
                    found, changes, levels, images, arrivals, shapes[band], wide[band],
                    terms, jacobian,
                )  # fmt: skip
                for m in range(size, size + spare):
                    jacobian[m % size] += jacobian[m]
                _curved(live[here], jacobian, envelope, weight, whole, square[band])
