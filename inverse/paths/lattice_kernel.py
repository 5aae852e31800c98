"""Mirror images of a box and their derivatives, compiled.

Every routine walks the same lattice: along each axis an image has an integer m
and a parity q, mirrored |m - q| times in the low wall and |m| in the high one
(Allen and Berkley, J. Acoust. Soc. Am. 65(4), 1979).
"""

from math import pi, sqrt

import numpy as np
from numba import njit

from rir.harmonics_kernel import order_of, turned_harmonics

__all__ = [
    "accumulate_rows",
    "add_pulse",
    "add_row",
    "fill_pulse",
    "fill_slope",
    "path_gain",
    "path_slopes",
    "render_rows",
    "wall_counts",
]

GEOMETRY = 11  # parameters before the walls': turn 3, low 3, high 3, speed, latency
NEAREST_M = 0.05  # shorter paths count as so long: within a device 1/r does not hold


@njit(cache=True, fastmath=True)
def path_gain(turn, x, y, z, coefficients, basis):
    """Return a pattern's gain towards a room direction; fills its harmonics."""
    if len(coefficients) == 1:
        basis[0] = sqrt(0.25 / pi)
        return coefficients[0] * basis[0]
    turned_harmonics(turn, x, y, z, order_of(len(coefficients)), basis)
    total = 0.0
    for k in range(len(coefficients)):
        total += coefficients[k] * basis[k]
    return total


@njit(cache=True, fastmath=True)
def fill_pulse(bank, x, pulse):
    """Write the taps of a pulse at x = 2 f - 1 of its fraction f into `pulse`."""
    moments, taps = bank.shape
    for tap in range(taps):
        pulse[tap] = bank[moments - 1, tap]
    for moment in range(moments - 2, -1, -1):
        for tap in range(taps):
            pulse[tap] = pulse[tap] * x + bank[moment, tap]


@njit(cache=True, fastmath=True)
def fill_slope(bank, x, slope):
    """Write the derivative of the taps by the arrival time in samples."""
    moments, taps = bank.shape
    for tap in range(taps):
        slope[tap] = 2.0 * (moments - 1) * bank[moments - 1, tap]
    for moment in range(moments - 2, 0, -1):
        for tap in range(taps):
            slope[tap] = slope[tap] * x + 2.0 * moment * bank[moment, tap]


@njit(cache=True, fastmath=True)
def add_pulse(out, pulse, start, factor):
    """Add a pulse that may stand out at either end."""
    first = max(0, -start)
    last = min(len(pulse), len(out) - start)
    for tap in range(first, last):
        out[start + tap] += factor * pulse[tap]


@njit(cache=True, fastmath=True)
def wall_counts(index, parity):
    """Return how often an image is mirrored in both walls of an axis."""
    return abs(index - parity), abs(index)


@njit(cache=True, fastmath=True)
def render_rows(
    emitters, listeners, turns, hearing, low, high, scale, latency, reach, walls,
    emitting, listening, bank, lead, least, most, out,
):  # fmt: skip
    """Add the images of all rows to samples.

    Parameters
    ----------
    emitters, listeners : ndarray, shape (rows, 3)
        In the frame of the box.
    turns, hearing : ndarray, shape (rows, 3, 3)
        From the frame of the box to each emitter's and listener's own.
    low, high : ndarray, shape (3,)
        Corners of the box.
    scale, latency, reach : float
        Samples a metre, samples before every arrival, longest path in metres.
    walls : ndarray, shape (6,)
        Reflection factors: low x, high x, low y and so on.
    emitting, listening : ndarray, shape (harmonics,)
        Patterns.
    bank, lead : ndarray, shape (moments, taps), and int
        Pulse; see `inverse.paths.bank`.
    least, most : int
        Fewest and most reflections of an image.
    out : ndarray, shape (rows, n)
        Added to.
    """
    pulse = np.empty(bank.shape[1])
    first, second = np.empty(len(emitting)), np.empty(len(listening))
    size = high - low
    most_x = int(reach / (2 * size[0])) + 2
    most_y = int(reach / (2 * size[1])) + 2
    most_z = int(reach / (2 * size[2])) + 2
    for row in range(len(emitters)):
        e, h = emitters[row] - low, listeners[row] - low
        for mx in range(-most_x, most_x + 1):
            for px in range(2):
                vx = h[0] - (1 - 2 * px) * e[0] - 2 * mx * size[0]
                ax, bx = wall_counts(mx, px)
                if vx * vx > reach * reach or ax + bx > most:
                    continue
                gx = walls[0] ** ax * walls[1] ** bx
                for my in range(-most_y, most_y + 1):
                    for py in range(2):
                        vy = h[1] - (1 - 2 * py) * e[1] - 2 * my * size[1]
                        ay, by = wall_counts(my, py)
                        left = reach * reach - vx * vx - vy * vy
                        if left < 0.0 or ax + bx + ay + by > most:
                            continue
                        gy = gx * walls[2] ** ay * walls[3] ** by
                        for mz in range(-most_z, most_z + 1):
                            for pz in range(2):
                                vz = h[2] - (1 - 2 * pz) * e[2] - 2 * mz * size[2]
                                az, bz = wall_counts(mz, pz)
                                order = ax + bx + ay + by + az + bz
                                if vz * vz > left or order > most or order < least:
                                    continue
                                length = sqrt(vx * vx + vy * vy + vz * vz)
                                length = max(length, NEAREST_M)
                                at = length * scale + latency
                                row_at = int(np.floor(at))
                                if row_at - lead >= out.shape[1]:
                                    continue
                                ux, uy, uz = vx / length, vy / length, vz / length
                                gain = gy * walls[4] ** az * walls[5] ** bz / length
                                gain *= path_gain(
                                    turns[row],
                                    (1 - 2 * px) * ux,
                                    (1 - 2 * py) * uy,
                                    (1 - 2 * pz) * uz,
                                    emitting,
                                    first,
                                )
                                gain *= path_gain(
                                    hearing[row], -ux, -uy, -uz, listening, second
                                )
                                fill_pulse(bank, 2.0 * (at - row_at) - 1.0, pulse)
                                add_pulse(out[row], pulse, row_at - lead, gain)


@njit(cache=True, fastmath=True)
def accumulate_rows(
    emitters, listeners, turns, hearing, low, high, scale, latency, reach, walls,
    emitting, listening, bank, lead, least, most, center, speed, rate, active,
    targets, weights, slow, square, right, misfit,
):  # fmt: skip
    """Add up the normal equations of Gauss-Newton over all rows.

    Parameters
    ----------
    center : ndarray, shape (3,)
        Point the box turns about, in its own frame.
    speed, rate : float
        Speed of sound and sample rate.
    active : ndarray of bool, shape (GEOMETRY + 6 + harmonics,)
        Parameters that move.
    targets : ndarray, shape (rows, n)
        Measured responses.
    weights : ndarray, shape (rows,)
        Weight of each row's squared error.
    slow : ndarray, shape (n, K)
        Orthonormal columns that errors may hold at no cost.
    square, right : ndarray
        Filled with J^T J and J^T r of all parameters.
    misfit : ndarray, shape (rows,)
        Filled with each row's squared error.
    """
    n = targets.shape[1]
    count = len(active)
    taps = bank.shape[1]
    pulse, slope = np.empty(taps), np.empty(taps)
    first, second = np.empty(len(emitting)), np.empty(len(listening))
    jacobian = np.zeros((count, n))
    model = np.zeros(n)
    moved = np.zeros(9)
    size = high - low
    most_x = int(reach / (2 * size[0])) + 2
    most_y = int(reach / (2 * size[1])) + 2
    most_z = int(reach / (2 * size[2])) + 2
    counts = np.zeros(6)
    sign = np.empty(3)
    v = np.empty(3)
    index = np.empty(3)
    parity = np.empty(3)
    square[:] = 0.0
    right[:] = 0.0
    for row in range(len(emitters)):
        jacobian[:] = 0.0
        model[:] = 0.0
        e, h = emitters[row] - low, listeners[row] - low
        about_e, about_h = emitters[row] - center, listeners[row] - center
        for mx in range(-most_x, most_x + 1):
            for px in range(2):
                v[0] = h[0] - (1 - 2 * px) * e[0] - 2 * mx * size[0]
                ax, bx = wall_counts(mx, px)
                if v[0] * v[0] > reach * reach or ax + bx > most:
                    continue
                for my in range(-most_y, most_y + 1):
                    for py in range(2):
                        v[1] = h[1] - (1 - 2 * py) * e[1] - 2 * my * size[1]
                        ay, by = wall_counts(my, py)
                        left = reach * reach - v[0] * v[0] - v[1] * v[1]
                        if left < 0.0 or ax + bx + ay + by > most:
                            continue
                        for mz in range(-most_z, most_z + 1):
                            for pz in range(2):
                                v[2] = h[2] - (1 - 2 * pz) * e[2] - 2 * mz * size[2]
                                az, bz = wall_counts(mz, pz)
                                order = ax + bx + ay + by + az + bz
                                if v[2] * v[2] > left or order > most or order < least:
                                    continue
                                length = sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
                                length = max(length, NEAREST_M)
                                at = length * scale + latency
                                row_at = int(np.floor(at))
                                start = row_at - lead
                                if start >= n or start + taps <= 0:
                                    continue
                                index[0], index[1], index[2] = mx, my, mz
                                parity[0], parity[1], parity[2] = px, py, pz
                                counts[0], counts[1], counts[2] = ax, bx, ay
                                counts[3], counts[4], counts[5] = by, az, bz
                                for axis in range(3):
                                    sign[axis] = 1.0 - 2.0 * parity[axis]
                                bare = 1.0 / length
                                for wall in range(6):
                                    bare *= walls[wall] ** counts[wall]
                                bare *= path_gain(
                                    hearing[row],
                                    -v[0] / length,
                                    -v[1] / length,
                                    -v[2] / length,
                                    listening,
                                    second,
                                )
                                leave = path_gain(
                                    turns[row],
                                    sign[0] * v[0] / length,
                                    sign[1] * v[1] / length,
                                    sign[2] * v[2] / length,
                                    emitting,
                                    first,
                                )
                                gain = bare * leave
                                x = 2.0 * (at - row_at) - 1.0
                                fill_pulse(bank, x, pulse)
                                add_pulse(model, pulse, start, gain)
                                fill_slope(bank, x, slope)
                                path_slopes(
                                    v, length, index, parity, sign, about_e, about_h,
                                    moved,
                                )  # fmt: skip
                                for k in range(9):
                                    if active[k]:
                                        add_pulse(
                                            jacobian[k],
                                            slope,
                                            start,
                                            gain * moved[k] * scale,
                                        )
                                if active[9]:
                                    later = -length * rate / (speed * speed)
                                    add_pulse(jacobian[9], slope, start, gain * later)
                                if active[10]:
                                    add_pulse(jacobian[10], slope, start, gain)
                                for wall in range(6):
                                    here = GEOMETRY + wall
                                    if active[here] and counts[wall] > 0:
                                        part = gain * counts[wall] / walls[wall]
                                        add_pulse(jacobian[here], pulse, start, part)
                                for k in range(len(emitting)):
                                    here = GEOMETRY + 6 + k
                                    if active[here]:
                                        add_pulse(
                                            jacobian[here],
                                            pulse,
                                            start,
                                            bare * first[k],
                                        )
        misfit[row] = add_row(
            targets[row], model, jacobian, weights[row], slow, square, right
        )


@njit(cache=True, fastmath=True)
def add_row(target, model, jacobian, weight, slow, square, right):
    """Add a row to the normal equations; return its squared error.

    What lies in the columns of `slow` is not counted; `model` becomes the residual.
    """
    for i in range(len(target)):
        model[i] = target[i] - model[i]
    free = np.dot(slow.T, model)
    if weight > 0.0:
        freed = np.dot(jacobian, slow)
        square += weight * np.dot(jacobian, jacobian.T)
        square -= weight * np.dot(freed, freed.T)
        right += weight * np.dot(jacobian, model)
        right -= weight * np.dot(freed, free)
    return np.dot(model, model) - np.dot(free, free)


@njit(cache=True, fastmath=True)
def path_slopes(v, length, index, parity, sign, about_e, about_h, moved):
    """Write how a path's length follows the turn, low and high of the box."""
    y0 = about_h[0] * 1.0
    y1 = about_h[1] * 1.0
    y2 = about_h[2] * 1.0
    z0, z1, z2 = about_e[0], about_e[1], about_e[2]
    moved[0] = (v[1] * (-y2 + sign[1] * z2) + v[2] * (y1 - sign[2] * z1)) / length
    moved[1] = (v[0] * (y2 - sign[0] * z2) + v[2] * (-y0 + sign[2] * z0)) / length
    moved[2] = (v[0] * (-y1 + sign[0] * z1) + v[1] * (y0 - sign[1] * z0)) / length
    for axis in range(3):
        moved[3 + axis] = v[axis] * 2.0 * (index[axis] - parity[axis]) / length
        moved[6 + axis] = -v[axis] * 2.0 * index[axis] / length
