"""Add arrivals to a grid of moments, from which pulses are shaped later.

An arrival between samples i and i + 1 with fraction f leaves its gain times the
powers 0…7 of x = 2f - 1 at row i. `rooms.kernels.pulses` turns the rows into
samples with one fixed filter bank, so an arrival costs the same whatever the
length of its pulse (a Farrow structure; Laakso et al., "Splitting the unit
delay", IEEE Signal Processing Magazine 13(1), 1996).
"""

from math import sqrt

import numpy as np
from numba import njit

from rooms.box_images import NEAREST
from rooms.kernels.patterns import looked_up, pattern_gains

MOMENTS = 8  # most powers, 0 to 7: a pulse exact to -100 dB (docs/decisions/0042)
LANES = 8  # bands are padded to eight, so that one wide register holds them


@njit(inline="always")
def _add(grid, at, gain):
    """Add one arrival after `at` samples, with a gain in each lane."""
    row = int(at)
    x = 2.0 * (at - row) - 1.0
    if grid.shape[2] == 1:
        power = gain[0]
        for moment in range(MOMENTS):
            grid[row, moment, 0] += power
            power *= x
    else:
        # all lanes of a moment lie side by side: the inner loop vectorises
        for moment in range(grid.shape[1]):
            for lane in range(grid.shape[2]):
                grid[row, moment, lane] += gain[lane]
                gain[lane] *= x


@njit(cache=True, nogil=True, fastmath=True)
def deposit_paths(delays, gains, grid):
    """Add paths of given delays [samples] and gains (paths, lanes) to a grid."""
    gain = np.empty(grid.shape[2])
    for path in range(len(delays)):
        if delays[path] >= 0.0 and delays[path] < grid.shape[0]:
            gain[:] = gains[path]
            _add(grid, delays[path], gain)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def deposit_lattice_flat(dx, dy, dz, gx, gy, gz, ox, oy, orders, scale, moments):
    """Add every shoebox image between the first row and the last, one band.

    `dx` and its like hold the signed offsets of the images along one axis [m],
    `gx` their gains, `ox` their reflection counts; offset and gain separate per
    axis, so that an image costs one square root. `orders` are the lowest and the
    highest reflection order.
    """
    first_order, order = orders
    last = len(moments) // MOMENTS - 1.0
    reach = last / scale
    mid = len(dz) // 2
    pitch = max((dz[-1] - dz[0]) / max(1, len(dz) - 1), 1e-9)
    at, gain = np.empty(len(dz)), np.empty(len(dz))
    for i in range(len(dx)):
        for j in range(len(dy)):
            rest = order - ox[i] - oy[j]
            across = dx[i] * dx[i] + dy[j] * dy[j]
            room = reach * reach - across
            if rest < 0 or room <= 0.0:
                continue
            span = min(mid, rest, int(sqrt(room) / pitch) + 2)
            low, count = mid - span, 2 * span + 1
            # square roots and divisions in a loop of their own vectorise
            for k in range(count):
                distance = sqrt(across + dz[low + k] * dz[low + k])
                at[k] = distance * scale
                gain[k] = gx[i] * gy[j] * gz[low + k] / max(distance, NEAREST)
            listed = first_order - ox[i] - oy[j]
            for k in range(count):
                if at[k] >= last or abs(k - span) < listed:
                    continue
                row = int(at[k])
                x = 2.0 * (at[k] - row) - 1.0
                xx = x * x
                fourth = xx * xx
                a = gain[k]
                b, c = a * x, a * xx
                d = b * xx
                first = 8 * row
                moments[first] += a
                moments[first + 1] += b
                moments[first + 2] += c
                moments[first + 3] += d
                moments[first + 4] += a * fourth
                moments[first + 5] += b * fourth
                moments[first + 6] += c * fourth
                moments[first + 7] += d * fourth


@njit(cache=True, nogil=True, fastmath=True)
def deposit_lattice_bands(dx, dy, dz, gx, gy, gz, ox, oy, oz, orders, scale, grid):
    """Add every shoebox image, eight bands at once; see `deposit_lattice_flat`.

    A grid with room for four moments gets four.
    """
    first_order, order = orders
    fine = grid.shape[1] > 4
    reach = (grid.shape[0] - 1.0) / scale
    gain = np.empty(LANES)
    mid = len(dz) // 2
    pitch = max((dz[-1] - dz[0]) / max(1, len(dz) - 1), 1e-9)
    for i in range(len(dx)):
        for j in range(len(dy)):
            rest = order - ox[i] - oy[j]
            across = dx[i] * dx[i] + dy[j] * dy[j]
            room = reach * reach - across
            if rest < 0 or room <= 0.0:
                continue
            for lane in range(LANES):
                gain[lane] = gx[i, lane] * gy[j, lane]
            span = min(mid, rest, int(sqrt(room) / pitch) + 2)
            for k in range(mid - span, mid + span + 1):
                square = dz[k] * dz[k]
                if square >= room:
                    continue
                if ox[i] + oy[j] + oz[k] < first_order:
                    continue
                distance = sqrt(across + square)
                at = distance * scale
                row = int(at)
                x = 2.0 * (at - row) - 1.0
                xx = x * x
                moments, far = grid[row], gz[k]
                spread = 1.0 / max(distance, NEAREST)
                for lane in range(LANES):
                    g = gain[lane] * far[lane] * spread
                    moments[0, lane] += g
                    moments[1, lane] += g * x
                    moments[2, lane] += g * xx
                    moments[3, lane] += g * xx * x
                if not fine:
                    continue
                for lane in range(LANES):
                    h = gain[lane] * far[lane] * spread * xx * xx
                    moments[4, lane] += h
                    moments[5, lane] += h * x
                    moments[6, lane] += h * xx
                    moments[7, lane] += h * xx * x


@njit(cache=True, nogil=True, fastmath=True)
def deposit_lattice_angles(
    dx, dy, dz, gx, gy, gz, ox, oy, oz, orders, scale, classes, grid
):
    """Add every shoebox image, eight bands at once, where walls reflect by angle.

    `gx` and its like have a row for each image and for each of the `classes` that
    divide the cosine of the way to the axis evenly; see `deposit_lattice_bands`.
    """
    first_order, order = orders
    fine = grid.shape[1] > 4
    reach = (grid.shape[0] - 1.0) / scale
    gain = np.empty(LANES)
    mid = len(dz) // 2
    pitch = max((dz[-1] - dz[0]) / max(1, len(dz) - 1), 1e-9)
    for i in range(len(dx)):
        for j in range(len(dy)):
            rest = order - ox[i] - oy[j]
            across = dx[i] * dx[i] + dy[j] * dy[j]
            room = reach * reach - across
            if rest < 0 or room <= 0.0:
                continue
            # so many classes for each metre over the distance
            ax, ay = abs(dx[i]) * classes, abs(dy[j]) * classes
            span = min(mid, rest, int(sqrt(room) / pitch) + 2)
            for k in range(mid - span, mid + span + 1):
                square = dz[k] * dz[k]
                if square >= room:
                    continue
                if ox[i] + oy[j] + oz[k] < first_order:
                    continue
                distance = sqrt(across + square)
                spread = 1.0 / max(distance, NEAREST)
                one = gx[i * classes + min(int(ax * spread), classes - 1)]
                two = gy[j * classes + min(int(ay * spread), classes - 1)]
                az = abs(dz[k]) * classes
                three = gz[k * classes + min(int(az * spread), classes - 1)]
                at = distance * scale
                row = int(at)
                x = 2.0 * (at - row) - 1.0
                xx = x * x
                moments = grid[row]
                for lane in range(LANES):
                    g = one[lane] * two[lane] * three[lane] * spread
                    gain[lane] = g * xx * xx
                    moments[0, lane] += g
                    moments[1, lane] += g * x
                    moments[2, lane] += g * xx
                    moments[3, lane] += g * xx * x
                if not fine:
                    continue
                for lane in range(LANES):
                    h = gain[lane]
                    moments[4, lane] += h
                    moments[5, lane] += h * x
                    moments[6, lane] += h * xx
                    moments[7, lane] += h * xx * x


@njit(cache=True, nogil=True)
def deposit_lattice_patterns(
    dx, dy, dz, gx, gy, gz, ox, oy, oz, orders, scale, classes, ends, grid
):
    """Add every shoebox image, weighed by the gain patterns of both ends: see `_weigh`.

    Where walls reflect by angle, `gx` and its like have a row for each image and for
    each of the `classes` that divide the cosine of the way to the axis evenly.
    """
    first_order, order = orders
    emitting, listening = ends
    lanes = grid.shape[2]
    reach = (grid.shape[0] - 1.0) / scale
    gain, both = np.empty(lanes), np.empty((2, lanes))
    sent, heard = np.empty(emitting[1].shape[1]), np.empty(listening[1].shape[1])
    work = sent, heard, both
    mid = len(dz) // 2
    pitch = max((dz[-1] - dz[0]) / max(1, len(dz) - 1), 1e-9)
    for i in range(len(dx)):
        for j in range(len(dy)):
            rest = order - ox[i] - oy[j]
            across = dx[i] * dx[i] + dy[j] * dy[j]
            room = reach * reach - across
            if rest < 0 or room <= 0.0:
                continue
            span = min(mid, rest, int(sqrt(room) / pitch) + 2)
            for k in range(mid - span, mid + span + 1):
                square = dz[k] * dz[k]
                if square >= room or ox[i] + oy[j] + oz[k] < first_order:
                    continue
                distance = max(sqrt(across + square), NEAREST)
                ux, uy, uz = dx[i] / distance, dy[j] / distance, dz[k] / distance
                # a mirrored axis turns the departure the same way as the arrival
                vx = ux if ox[i] % 2 else -ux
                vy = uy if oy[j] % 2 else -uy
                vz = uz if oz[k] % 2 else -uz
                _weigh(emitting, listening, (vx, vy, vz), (ux, uy, uz), work, gain)
                a, b, c = i, j, k
                if classes > 1:
                    a = i * classes + min(int(abs(ux) * classes), classes - 1)
                    b = j * classes + min(int(abs(uy) * classes), classes - 1)
                    c = k * classes + min(int(abs(uz) * classes), classes - 1)
                for lane in range(lanes):
                    gain[lane] *= gx[a, lane] * gy[b, lane] * gz[c, lane] / distance
                _add(grid, distance * scale, gain)


@njit(cache=True, nogil=True)
def _weigh(emitting, listening, leave, reach, work, weight):
    """Write the gains of the patterns of both ends, multiplied.

    `emitting` and `listening` are (turn (3, 3), coefficients (lanes, harmonics), table
    (directions, lanes)): the turn takes room directions into the device frame. Gains
    are looked up where there is a table, see `rooms.kernels.patterns.looked_up`.
    """
    side = int(sqrt(len(emitting[2]) / 6.0) + 0.5)
    sent, heard, both = work
    if side > 0:
        one = looked_up(emitting[0], side, leave[0], leave[1], leave[2])
        two = looked_up(listening[0], side, reach[0], reach[1], reach[2])
        for lane in range(len(weight)):
            weight[lane] = emitting[2][one, lane] * listening[2][two, lane]
        return
    turn, rows = emitting[0], emitting[1]
    pattern_gains(turn, rows, leave[0], leave[1], leave[2], sent, both[0])
    turn, rows = listening[0], listening[1]
    pattern_gains(turn, rows, reach[0], reach[1], reach[2], heard, both[1])
    for lane in range(len(weight)):
        weight[lane] = both[0, lane] * both[1, lane]


@njit(cache=True, nogil=True)
def deposit_waves(waves, amplitude, ends, first, rates, patterns, grid):
    """Add random plane waves and their twins, which go the other way around.

    Parameters
    ----------
    waves : tuple of ndarray
        Times of arrival in the middle of the room [s], shape (n,), signs, and the
        two directions, shape (2, n, 3).
    amplitude : ndarray, shape (steps, lanes)
        Of one wave as a function of its arrival.
    ends : ndarray, shape (2, 3)
        Ways from the middle of the room to the emitter and the listener [s].
    first : float
        Nothing arrives before [s].
    rates : tuple of float
        Samples, and steps of `amplitude`, per second.
    patterns : tuple (weighed, sent, turn, coefficients)
        Whether the ends have gain patterns; the emitter's gains, (2, n, lanes); the
        listener's turn and coefficients.
    grid : ndarray, shape (rows, moments, lanes)
        Gets the moments.

    Notes
    -----
    Not compiled with fast arithmetic: fused products are not the same in either order
    of the ends.
    """
    times, signs, ways = waves
    weighed, sent, turn, coefficients = patterns
    lanes = grid.shape[2]
    gain, heard = np.empty(lanes), np.empty((2, lanes))
    basis = np.empty(coefficients.shape[1])
    for n in range(len(times)):
        known = False
        for k in range(2):
            leave, reach = ways[k, n], ways[1 - k, n]
            out = leave[0] * ends[0, 0] + leave[1] * ends[0, 1] + leave[2] * ends[0, 2]
            back = reach[0] * ends[1, 0] + reach[1] * ends[1, 1] + reach[2] * ends[1, 2]
            delay = times[n] - (out + back)
            at = delay * rates[0]
            if delay < first or at >= grid.shape[0]:
                continue
            step = min(int(delay * rates[1]), len(amplitude) - 1)
            for lane in range(lanes):
                gain[lane] = amplitude[step, lane] * signs[n]
            if weighed:
                if not known:
                    for m in range(2):
                        x, y, z = ways[m, n]
                        pattern_gains(turn, coefficients, x, y, z, basis, heard[m])
                    known = True
                for lane in range(lanes):
                    gain[lane] *= sent[k, n, lane] * heard[1 - k, lane]
            _add(grid, at, gain)


@njit(cache=True, nogil=True)
def gains_towards(turn, coefficients, ways, out):
    """Write the gains (2, n, lanes) of a pattern along ways (2, n, 3)."""
    basis = np.empty(coefficients.shape[1])
    for k in range(2):
        for n in range(ways.shape[1]):
            x, y, z = ways[k, n]
            pattern_gains(turn, coefficients, x, y, z, basis, out[k, n])
