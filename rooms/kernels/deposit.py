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

from rooms.kernels.patterns import looked_up, pattern_gains

MOMENTS = 8  # most powers, 0 to 7: a pulse exact to -100 dB (docs/decisions/0042)
LANES = 8  # bands are padded to eight, so that one wide register holds them
NEAREST = 0.01  # m: images nearer count as there, since no transducer is a point


@njit(cache=True, nogil=True, fastmath=True)
def deposit_paths(delays, gains, grid):
    """Add paths of given delays [samples] and gains (paths, lanes) to a grid."""
    lanes = grid.shape[2]
    for path in range(len(delays)):
        if not delays[path] >= 0.0 or delays[path] >= grid.shape[0]:
            continue
        row = int(delays[path])
        x = 2.0 * (delays[path] - row) - 1.0
        power = 1.0
        for moment in range(grid.shape[1]):
            for lane in range(lanes):
                grid[row, moment, lane] += power * gains[path, lane]
            power *= x


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
    dx,
    dy,
    dz,
    gx,
    gy,
    gz,
    ox,
    oy,
    oz,
    orders,
    scale,
    classes,
    emitting,
    listening,
    grid,
):
    """Add every shoebox image, weighted by the gain patterns of both ends.

    `emitting` and `listening` are (turn (3, 3), coefficients (lanes, harmonics), table
    (directions, lanes)): the turn takes room directions into the device frame. Gains
    are looked up where there is a table, see `rooms.kernels.patterns.looked_up`.
    Where walls reflect by angle, `gx` and its like have a row for each image and for
    each of the `classes` that divide the cosine of the way to the axis evenly.
    """
    side = int(sqrt(len(emitting[2]) / 6.0) + 0.5)
    first_order, order = orders
    reach = (grid.shape[0] - 1.0) / scale
    lanes = grid.shape[2]
    leave, reach_in = np.empty(lanes), np.empty(lanes)
    sent, heard = np.empty(emitting[1].shape[1]), np.empty(listening[1].shape[1])
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
                if square >= room:
                    continue
                if ox[i] + oy[j] + oz[k] < first_order:
                    continue
                distance = max(sqrt(across + square), NEAREST)
                ux, uy, uz = dx[i] / distance, dy[j] / distance, dz[k] / distance
                # A mirrored axis turns the departure the same way as the arrival.
                sx = 1.0 if ox[i] % 2 else -1.0
                sy = 1.0 if oy[j] % 2 else -1.0
                sz = 1.0 if oz[k] % 2 else -1.0
                vx, vy, vz = sx * ux, sy * uy, sz * uz
                if side > 0:
                    one = looked_up(emitting[0], side, vx, vy, vz)
                    other = looked_up(listening[0], side, ux, uy, uz)
                    for lane in range(lanes):
                        leave[lane] = emitting[2][one, lane]
                        reach_in[lane] = listening[2][other, lane]
                else:
                    pattern_gains(emitting[0], emitting[1], vx, vy, vz, sent, leave)
                    pattern_gains(
                        listening[0], listening[1], ux, uy, uz, heard, reach_in
                    )
                at = distance * scale
                row = int(at)
                x = 2.0 * (at - row) - 1.0
                a, b, c = i, j, k
                if classes > 1:
                    a = i * classes + min(int(abs(ux) * classes), classes - 1)
                    b = j * classes + min(int(abs(uy) * classes), classes - 1)
                    c = k * classes + min(int(abs(uz) * classes), classes - 1)
                for lane in range(lanes):
                    far = gx[a, lane] * gy[b, lane] * gz[c, lane] / distance
                    leave[lane] = leave[lane] * reach_in[lane] * far
                # all lanes of a moment lie side by side: the inner loop vectorises
                for moment in range(grid.shape[1]):
                    for lane in range(lanes):
                        grid[row, moment, lane] += leave[lane]
                        leave[lane] *= x
