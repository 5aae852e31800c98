"""Mirror images of a box in half octaves, and how they move, compiled.

A wall reflects by its admittance b over that of air, R = (cos - b) / (cos + b), or by
one factor at all angles. The same image serves all bands, so images are listed first.
"""

from math import sqrt

import numpy as np
from numba import njit

from fields.path.band_arrivals import (
    BITS,
    add_arrivals,
    bounce,
    folded,
    place_arrivals,
    planar,
)
from fields.path.lattice_kernel import (
    NEAREST_M,
    _counts,
    _order_of,
    _path_slopes,
    harmonics,
)

__all__ = ["accumulate_places", "render_bands"]

LOSS, PHASE, PATTERN = 12, 13, 14
"""Columns of a band: walls (real and imaginary by turns), air, phase, patterns."""


@njit(cache=True, fastmath=True)
def _leave(turn, x, y, z, order, basis):
    a = turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z
    b = turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z
    c = turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z
    harmonics(a, b, c, order, basis)


@njit(cache=True, fastmath=True)
def list_images(
    e, h, turn, ear, low, high, reach, least, most, away, lattice, counts, leaving,
    arriving,
):  # fmt: skip
    """List the images of one pair and return how many there are.

    `away` takes the way to the listener and its length, `lattice` the integers and
    signs of each image, `counts` reflections by wall, `leaving` and `arriving` the
    harmonics of both directions.
    """
    size = high - low
    most_x = int(reach / (2 * size[0])) + 2
    most_y = int(reach / (2 * size[1])) + 2
    most_z = int(reach / (2 * size[2])) + 2
    emitting, listening = _order_of(leaving.shape[1]), _order_of(arriving.shape[1])
    n = 0
    for mx in range(-most_x, most_x + 1):
        for px in range(2):
            vx = h[0] - (1 - 2 * px) * e[0] - 2 * mx * size[0]
            ax, bx = _counts(mx, px)
            if vx * vx > reach * reach or ax + bx > most:
                continue
            for my in range(-most_y, most_y + 1):
                for py in range(2):
                    vy = h[1] - (1 - 2 * py) * e[1] - 2 * my * size[1]
                    ay, by = _counts(my, py)
                    left = reach * reach - vx * vx - vy * vy
                    if left < 0.0 or ax + bx + ay + by > most:
                        continue
                    for mz in range(-most_z, most_z + 1):
                        for pz in range(2):
                            vz = h[2] - (1 - 2 * pz) * e[2] - 2 * mz * size[2]
                            az, bz = _counts(mz, pz)
                            order = ax + bx + ay + by + az + bz
                            if vz * vz > left or order > most or order < least:
                                continue
                            if n == len(away):
                                return n
                            length = sqrt(vx * vx + vy * vy + vz * vz)
                            length = max(length, NEAREST_M)
                            away[n, 0], away[n, 1], away[n, 2] = vx, vy, vz
                            away[n, 3] = length
                            lattice[n, 0], lattice[n, 1], lattice[n, 2] = mx, my, mz
                            lattice[n, 3] = 1.0 - 2.0 * px
                            lattice[n, 4] = 1.0 - 2.0 * py
                            lattice[n, 5] = 1.0 - 2.0 * pz
                            counts[n, 0], counts[n, 1] = ax, bx
                            counts[n, 2], counts[n, 3] = ay, by
                            counts[n, 4], counts[n, 5] = az, bz
                            ux, uy, uz = vx / length, vy / length, vz / length
                            _leave(
                                turn,
                                (1 - 2 * px) * ux,
                                (1 - 2 * py) * uy,
                                (1 - 2 * pz) * uz,
                                emitting,
                                leaving[n],
                            )
                            _leave(ear, -ux, -uy, -uz, listening, arriving[n])
                            n += 1
    return n


@njit(cache=True, fastmath=True)
def _walls(walls, angled, away, counts):
    """Return the product of all reflections of an image in one band."""
    factor = 1.0 + 0.0j
    for wall in range(6):
        count = counts[wall]
        if count > 0:
            one = walls[wall]
            if angled:
                cosine = abs(away[wall // 2]) / away[3]
                one = (cosine - one) / (cosine + one)
            for _ in range(count):
                factor *= one
    return factor


@njit(cache=True, fastmath=True)
def _dot(coefficients, basis):
    total = 0.0
    for k in range(len(coefficients)):
        total += coefficients[k] * basis[k]
    return total


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
def _folded(jacobian, model, weight, square, right):
    """Add the normal equations of complex rows kept as halves."""
    count = len(right)
    both = np.dot(jacobian.T, jacobian)
    ends = np.dot(jacobian.T, model)
    for i in range(count):
        right[i] += weight * (ends[i, 0] + ends[count + i, 1])
        for j in range(count):
            square[i, j] += weight * (both[i, j] + both[count + i, count + j])


@njit(cache=True, fastmath=True)
def _compared(live, targets, jacobian, model):
    """Turn a model into what is left; return the squared sum."""
    total = 0.0
    for m in range(len(live)):
        if live[m]:
            model[m, 0] = targets[m].real - model[m, 0]
            model[m, 1] = targets[m].imag - model[m, 1]
            total += model[m, 0] ** 2 + model[m, 1] ** 2
        else:
            model[m] = 0.0
            jacobian[m] = 0.0
    return total


@njit(cache=True, fastmath=True)
def render_bands(
    emitters, listeners, turns, hearing, low, high, scale, latency, reach, walls,
    angled, loss, emitting, listening, least, most, starts, lengths, turn, rates, taps,
    widths, room_for, chosen, out,
):  # fmt: skip
    """Add the images of all rows to the `chosen` bands of (rows, total) envelopes."""
    away, lattice = np.empty((room_for, 4)), np.empty((room_for, 6))
    counts = np.empty((room_for, 6), dtype=np.int64)
    leaving = np.empty((room_for, emitting.shape[1]))
    arriving = np.empty((room_for, listening.shape[1]))
    cosines, bounces = np.empty((3, room_for)), np.empty((3, 2 + BITS, room_for))
    mirrored, values = np.empty((4, room_for)), np.empty(room_for, dtype=np.complex128)
    places, parts = np.empty((room_for, 2), dtype=np.int64), np.empty(room_for)
    fractions = taps.shape[1] - 1
    shapes, wide = planar(taps, widths)
    spare = np.empty((2, lengths.max() + shapes.shape[3]))
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
            said = np.dot(leaving[:found], emitting[band])
            heard = np.dot(arriving[:found], listening[band])
            for n in range(found):
                values[n] *= said[n] * heard[n]
            here = spare[:, : size + shapes.shape[3]]
            here[:] = 0.0
            add_arrivals(found, values, places, parts, shapes[band], wide[band], here)
            folded(here, size)
            for m in range(size):
                out[row, starts[band] + m] += complex(here[0, m], here[1, m])


@njit(cache=True, fastmath=True)
def accumulate_places(
    emitters, listeners, turns, hearing, low, high, scale, latency, reach, walls,
    angled, loss, emitting, listening, least, most, starts, lengths, turn, rates, taps,
    widths, slopes, room_for, live, chosen, center, speed, rate, targets, weights,
    square, right, misfit,
):  # fmt: skip
    """Add up each row's normal equations of geometry and both its places.

    Columns: turn 3, low 3, high 3, speed, latency (samples), listener 3, emitter 3,
    in the frame of the box. `square` (rows, 17, 17), `right` (rows, 17) and `misfit`
    (rows,) are sums over the `chosen` bands.
    """
    away, lattice = np.empty((room_for, 4)), np.empty((room_for, 6))
    counts = np.empty((room_for, 6), dtype=np.int64)
    leaving = np.empty((room_for, emitting.shape[1]))
    arriving = np.empty((room_for, listening.shape[1]))
    fractions = taps.shape[1] - 1
    columns = 17
    moved = np.empty((room_for, columns))
    terms = np.zeros((2, 2 * columns))
    spare = np.empty((lengths.max(), 2 * columns))
    told = np.empty((lengths.max(), 2))
    parity, sign = np.empty(3), np.empty(3)
    square[:], right[:], misfit[:] = 0.0, 0.0, 0.0
    for row in range(len(emitters)):
        found = list_images(
            emitters[row] - low, listeners[row] - low, turns[row], hearing[row], low,
            high, reach, least, most, away, lattice, counts, leaving, arriving,
        )  # fmt: skip
        for n in range(found):
            length = away[n, 3]
            for axis in range(3):
                sign[axis] = lattice[n, 3 + axis]
                parity[axis] = 0.5 - 0.5 * sign[axis]
                moved[n, 11 + axis] = away[n, axis] / length * scale
                moved[n, 14 + axis] = -sign[axis] * away[n, axis] / length * scale
            _path_slopes(
                away[n], length, lattice[n], parity, sign, emitters[row] - center,
                listeners[row] - center, moved[n],
            )  # fmt: skip
            for k in range(9):
                moved[n, k] *= scale
            moved[n, 9] = -length * rate / (speed * speed)
            moved[n, 10] = 1.0
        for band in range(len(starts)):
            if not chosen[band]:
                continue
            size = lengths[band]
            width = widths[band]
            lead = width // 2 - 1
            jacobian, model = spare[:size], told[:size]
            jacobian[:], model[:] = 0.0, 0.0
            for n in range(found):
                length = away[n, 3]
                gain = np.exp(-loss[band] * length) / length
                gain *= _dot(emitting[band], leaving[n])
                gain *= _dot(listening[band], arriving[n])
                at = length * scale + latency
                angle = turn[band] * at
                value = _walls(walls[band], angled, away[n], counts[n])
                value *= gain * complex(np.cos(angle), -np.sin(angle))
                place = at * rates[band]
                base = int(np.floor(place))
                fine = (place - base) * fractions
                step = int(fine)
                part = fine - step
                terms[0, :columns] = moved[n]
                _complete(terms)
                for tap in range(width):
                    shape = taps[band, step, tap]
                    shape += part * (taps[band, step + 1, tap] - shape)
                    slope = slopes[band, step, tap]
                    slope += part * (slopes[band, step + 1, tap] - slope)
                    m = (base - lead + tap) % size
                    now, change = value * shape, value * slope
                    model[m, 0] += now.real
                    model[m, 1] += now.imag
                    _add_turned(jacobian[m], terms, change.real, change.imag)
            here = slice(starts[band], starts[band] + size)
            weight = weights[row, band]
            left = _compared(live[here], targets[row, here], jacobian, model)
            misfit[row] += weight * left
            _folded(jacobian, model, weight, square[row], right[row])
