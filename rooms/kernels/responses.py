"""Fill a grid with all that reaches a listener, and shape it, listener by listener."""

import numpy as np
from numba import njit

from rooms.kernels.deposit import (
    deposit_lattice_angles,
    deposit_lattice_bands,
    deposit_lattice_flat,
    deposit_lattice_patterns,
    deposit_paths,
    deposit_waves,
)
from rooms.kernels.pulses import shape_lanes, shape_pulses


@njit(cache=True, nogil=True, fastmath=False)
def image_offsets(index, length, emitter, listener):
    """Return signed distances from the listener to the images along one axis.

    Written so that exchanging the ends changes signs only: reciprocity then holds
    to the last bit of each term.
    """
    offsets = np.empty(len(index))
    for n in range(len(index)):
        if index[n] % 2 == 0:
            offsets[n] = index[n] * length + (emitter - listener)
        else:
            offsets[n] = (index[n] + 1) * length - (emitter + listener)
    return offsets


@njit(cache=True, nogil=True)
def fill_and_shape(
    emitter, listeners, lattice, patterns, paths, waves, scale, grid, shaping, out
):
    """Compute band signals of several listeners, shape (listeners, lanes, n).

    Parameters
    ----------
    emitter, listeners : ndarray, shape (3,) and (listeners, 3)
        Positions [m].
    lattice : tuple (size, axes, orders, rows, fading, classes)
        Lengths of the shoebox; indices, gains and orders of the images along each
        axis; lowest and highest order; rows that images may fill and factors by which
        the last of them fade; the gains of `axes` have a row for each image and class
        of angles.
    patterns : tuple (weighed, emitter turn, emitter rows, listener turns, listener
        rows, emitter table, listener table)
        Whether there are gain patterns of the ends, and these.
    paths : tuple (starts, delays, gains)
        Single arrivals: those of listener i lie in starts[i]:starts[i + 1];
        delays in samples, gains per lane.
    waves : tuple (center, waves, amplitudes, sent, rates)
        Middle of the room [m], amplitudes for each listener or all, and see
        `rooms.kernels.deposit.deposit_waves`.
    scale : float
        Samples per metre.
    grid : ndarray, shape (rows, moments, lanes)
        Working space.
    shaping : tuple (decay, banks, sizes)
        See `rooms.kernels.pulses.shape_pulses`.
    out : ndarray, shape (listeners, lanes, n)
        Zeros on entry; starts LEAD samples before emission.
    """
    size, axes, orders, lattice_rows, fading, classes = lattice
    (ix, gx, ox), (iy, gy, oy), (iz, gz, oz) = axes
    weighed = patterns[0]
    starts, delays, gains = paths
    center, drawn, amplitudes, sent, rates = waves
    decay, banks, sizes = shaping
    per_metre = scale / rates[0]
    for place in range(len(listeners)):
        used = lattice_rows if len(drawn[0]) == 0 else grid.shape[0]
        for path in range(starts[place], starts[place + 1]):
            if delays[path] < grid.shape[0]:
                used = max(used, int(delays[path]) + 1)
        view = grid[:used]
        view[:] = 0.0
        emitting = (patterns[1], patterns[2], patterns[5])
        listening = (patterns[3][place], patterns[4], patterns[6])
        if lattice_rows > 0:
            dx = image_offsets(ix, size[0], emitter[0], listeners[place, 0])
            dy = image_offsets(iy, size[1], emitter[1], listeners[place, 1])
            dz = image_offsets(iz, size[2], emitter[2], listeners[place, 2])
            box = grid[:lattice_rows]
            if weighed:
                deposit_lattice_patterns(
                    dx, dy, dz, gx, gy, gz, ox, oy, oz, orders, scale, classes,
                    (emitting, listening), box,
                )  # fmt: skip
            elif classes > 1:
                deposit_lattice_angles(
                    dx, dy, dz, gx, gy, gz, ox, oy, oz, orders, scale, classes, box
                )
            elif grid.shape[2] == 1:
                deposit_lattice_flat(
                    dx, dy, dz, gx[:, 0], gy[:, 0], gz[:, 0], ox, oy, orders, scale,
                    grid.reshape(-1)[: 8 * lattice_rows],
                )  # fmt: skip
            else:
                deposit_lattice_bands(
                    dx, dy, dz, gx, gy, gz, ox, oy, oz, orders, scale, box
                )
            begin = lattice_rows - len(fading)
            for row in range(len(fading)):
                box[begin + row] *= fading[row]
        some = slice(starts[place], starts[place + 1])
        deposit_paths(delays[some], gains[some], view)
        if len(drawn[0]) > 0:
            ways = np.empty((2, 3))
            ways[0] = (emitter - center) * per_metre
            ways[1] = (listeners[place] - center) * per_metre
            straight = emitter - listeners[place]
            first = np.sqrt(np.sum(straight * straight)) * per_metre
            hearing = (weighed, sent, listening[0], listening[1])
            amplitude = amplitudes[place % len(amplitudes)]
            deposit_waves(drawn, amplitude, ways, first, rates, hearing, view)
        if grid.shape[2] == 1:
            shape_pulses(view, decay, banks, sizes, out[place])
        else:
            shape_lanes(view, decay, banks, sizes, out[place])
