"""Normal equations of what belongs to one half octave only, compiled."""

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
from inverse.bands.band_kernel import (
    LOSS,
    PATTERN,
    PHASE,
    _add_turned,
    _complete,
    list_images,
)

__all__ = ["accumulate_bands", "continued", "left_of"]


@njit(cache=True, fastmath=True)
def left_of(live, targets, model):
    """Turn a model into what it leaves; return the squared sum."""
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
def continued(model, size):
    """Write an envelope on behind its end."""
    for m in range(size, model.shape[1]):
        for half in range(2):
            model[half, m] = model[half, m % size]


@njit(cache=True, fastmath=True)
def _wall_changes(found, away, counts, walls, angled, values, changes):
    """Write how images follow the walls of one band, shape (2, images, 6)."""
    for n in range(found):
        for wall in range(6):
            count = counts[n, wall]
            if count == 0:
                changes[0, n, wall], changes[1, n, wall] = 0.0, 0.0
                continue
            one = walls[wall]
            above = values[n] * count
            if angled:
                cosine = abs(away[n, wall // 2]) / away[n, 3]
                one = cosine * cosine - one * one
                above *= -2.0 * cosine
            level = 1.0 / (one.real * one.real + one.imag * one.imag)
            changes[0, n, wall] = level * (
                above.real * one.real + above.imag * one.imag
            )
            changes[1, n, wall] = level * (
                above.imag * one.real - above.real * one.imag
            )


@njit(cache=True, fastmath=True)
def _spread(
    found, changes, values, away, levels, leaving, arriving, places, parts, taps,
    width, terms, jacobian,
):  # fmt: skip
    """Add the derivatives of all images to those of an envelope, (size, 2 columns).

    Columns: six walls, air, patterns, real parts before imaginary ones; others are
    these turned by a right angle.
    """
    said, heard = leaving.shape[1], arriving.shape[1]
    columns = jacobian.shape[1] // 2
    real, imag = terms[0, :columns], terms[0, columns:]
    for n in range(found):
        real[:6], imag[:6] = changes[0, n], changes[1, n]
        whole = values[n]
        real[6], imag[6] = -away[n, 3] * whole.real, -away[n, 3] * whole.imag
        a, b = levels[0, n].real, levels[0, n].imag
        for k in range(said):
            real[7 + k], imag[7 + k] = a * leaving[n, k], b * leaving[n, k]
        if heard > 1:
            a, b = levels[1, n].real, levels[1, n].imag
            for k in range(heard):
                real[7 + said + k] = a * arriving[n, k]
                imag[7 + said + k] = b * arriving[n, k]
        _complete(terms)
        start, step, part = places[n, 0], places[n, 1], parts[n]
        low, high = taps[step], taps[step + 1]
        for tap in range(width):
            a = low[0, tap] + part * (high[0, tap] - low[0, tap])
            b = low[1, tap] + part * (high[1, tap] - low[1, tap])
            _add_turned(jacobian[start + tap], terms, a, b)


@njit(cache=True, fastmath=True)
def _curved(live, jacobian, told, weight, whole, square):
    """Add products of all columns; `told` is the envelope itself."""
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
            whole[row, PHASE] = sign * told[turned, m]
            for k in range(columns - 7):
                whole[row, PATTERN + k] = jacobian[m, here + 7 + k]
    used = whole[: 2 * size]
    square += weight * np.dot(used.T, used)


@njit(cache=True, fastmath=True)
def _sloped(found, changes, values, away, levels, leaving, arriving, echoes, right):
    """Add what is left along all columns; `echoes` is what each image's shape holds."""
    said, heard = leaving.shape[1], arriving.shape[1]
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
    right[PATTERN : PATTERN + said] += np.dot(first, leaving[:found])
    if heard > 1:
        right[PATTERN + said :] += np.dot(second, arriving[:found])


@njit(cache=True, fastmath=True)
def accumulate_bands(
    emitters, listeners, turns, hearing, low, high, scale, latency, reach, walls,
    angled, loss, emitting, listening, least, most, starts, lengths, turn, rates, taps,
    widths, room_for, live, chosen, curved, sloped, targets, weights, square, right,
    misfit,
):  # fmt: skip
    """Add up normal equations of every band's walls, air, phase and patterns.

    Parameters
    ----------
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
    away, lattice = np.empty((room_for, 4)), np.empty((room_for, 6))
    counts = np.empty((room_for, 6), dtype=np.int64)
    said, heard = emitting.shape[1], listening.shape[1]
    leaving, arriving = np.empty((room_for, said)), np.empty((room_for, heard))
    cosines, bounces = np.empty((3, room_for)), np.empty((3, 2 + BITS, room_for))
    mirrored, values = np.empty((4, room_for)), np.empty(room_for, dtype=np.complex128)
    levels = np.empty((2, room_for), dtype=np.complex128)
    echoes = np.empty(room_for, dtype=np.complex128)
    changes = np.empty((2, room_for, 6))
    places, parts = np.empty((room_for, 2), dtype=np.int64), np.empty(room_for)
    fractions = taps.shape[1] - 1
    shapes, wide = planar(taps, widths)
    spare = shapes.shape[3]
    longest = lengths.max() + spare
    more = heard if heard > 1 else 0
    terms = np.empty((2, 2 * (7 + said + more)))
    every = np.empty((longest, 2 * (7 + said + more)))
    whole = np.empty((2 * longest, PATTERN + said + more))
    both, told = np.empty((2, longest)), np.empty((2, longest))
    square[:], right[:], misfit[:] = 0.0, 0.0, 0.0
    for row in range(len(emitters)):
        found = list_images(
            emitters[row] - low, listeners[row] - low, turns[row], hearing[row], low,
            high, reach, least, most, away, lattice, counts, leaving, arriving,
        )  # fmt: skip
        bits = bounce(found, away, counts, cosines, bounces)
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
                levels[0, n], levels[1, n] = values[n] * arrive[n], values[n] * leave[n]
                values[n] *= leave[n] * arrive[n]
            model = both[:, : size + spare]
            model[:] = 0.0
            add_arrivals(found, values, places, parts, shapes[band], wide[band], model)
            folded(model, size)
            told[:, :size] = model[:, :size]
            here = slice(starts[band], starts[band] + size)
            weight = weights[row, band]
            misfit[row, band] = left_of(live[here], targets[row, here], model)
            if weight == 0.0 or not (curved or sloped):
                continue
            _wall_changes(found, away, counts, walls[band], angled, values, changes)
            if sloped:
                continued(model, size)
                heard_arrivals(
                    found, places, parts, shapes[band], wide[band], model, echoes
                )
                for n in range(found):
                    echoes[n] *= weight
                _sloped(
                    found, changes, values, away, levels, leaving, arriving, echoes,
                    right[band],
                )  # fmt: skip
            if curved:
                jacobian = every[: size + spare]
                jacobian[:] = 0.0
                _spread(
                    found, changes, values, away, levels, leaving, arriving, places,
                    parts, shapes[band], wide[band], terms, jacobian,
                )  # fmt: skip
                for m in range(size, size + spare):
                    jacobian[m % size] += jacobian[m]
                _curved(live[here], jacobian, told, weight, whole, square[band])
