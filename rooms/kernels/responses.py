"""Fill a grid with all that reaches a listener, and shape it, listener by listener."""

import numpy as np
from numba import njit

from rooms.kernels.deposit import (
    deposit_lattice_angles,
    deposit_lattice_bands,
    deposit_lattice_flat,
    deposit_lattice_patterns,
    deposit_paths,
)
from rooms.kernels.pulses import shape_pulses


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
    emitter,
    listeners,
    size,
    axes,
    limits,
    patterns,
    starts,
    delays,
    gains,
    grid,
    shaping,
    out,
):
    """Compute band signals of several listeners, shape (listeners, lanes, n).

    Parameters
    ----------
    emitter, listeners : ndarray, shape (3,) and (listeners, 3)
        Positions [m].
    size : ndarray, shape (3,)
        Lengths of the shoebox; unused without lattice rows.
    axes : tuple of (index, gains, orders) per axis
        See `rooms.kernels.deposit`.
    limits : tuple (orders, scale, lattice_rows, fading, patterned, classes)
        Lowest and highest order, samples per metre, rows the lattice may fill and
        factors by which the last of them fade, and whether `patterns` weigh the
        images; the gains of `axes` have a row for each image and class of angles.
    patterns : tuple (emitter turn, emitter rows, listener turns, listener rows,
        emitter table, listener table)
        Gain patterns of the ends.
    starts, delays, gains : ndarray
        Single arrivals: those of listener i lie in starts[i]:starts[i + 1];
        delays in samples, gains per lane.
    grid : ndarray, shape (rows, 8, lanes)
        Working space.
    shaping : tuple (decay, banks, sizes)
        See `rooms.kernels.pulses.shape_pulses`.
    out : ndarray, shape (listeners, lanes, n)
        Zeros on entry; starts LEAD samples before emission.
    """
    orders, scale, lattice_rows, fading, patterned, classes = limits
    (ix, gx, ox), (iy, gy, oy), (iz, gz, oz) = axes
    decay, banks, sizes = shaping
    lanes = grid.shape[2]
    for place in range(len(listeners)):
        used = lattice_rows
        for path in range(starts[place], starts[place + 1]):
            if delays[path] < grid.shape[0]:
                used = max(used, int(delays[path]) + 1)
        view = grid[:used]
        view[:] = 0.0
        if lattice_rows > 0:
            dx = image_offsets(ix, size[0], emitter[0], listeners[place, 0])
            dy = image_offsets(iy, size[1], emitter[1], listeners[place, 1])
            dz = image_offsets(iz, size[2], emitter[2], listeners[place, 2])
            box = grid[:lattice_rows]
            if patterned:
                emitting = (patterns[0], patterns[1], patterns[4])
                listening = (patterns[2][place], patterns[3], patterns[5])
                deposit_lattice_patterns(
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
                    box,
                )
            elif classes > 1:
                deposit_lattice_angles(
                    dx, dy, dz, gx, gy, gz, ox, oy, oz, orders, scale, classes, box
                )
            elif lanes == 1:
                deposit_lattice_flat(
                    dx,
                    dy,
                    dz,
                    gx[:, 0],
                    gy[:, 0],
                    gz[:, 0],
                    ox,
                    oy,
                    orders,
                    scale,
                    grid.reshape(-1)[: 8 * lattice_rows],
                )
            else:
                deposit_lattice_bands(
                    dx, dy, dz, gx, gy, gz, ox, oy, oz, orders, scale, box
                )
            begin = lattice_rows - len(fading)
            for row in range(len(fading)):
                box[begin + row] *= fading[row]
        some = slice(starts[place], starts[place + 1])
        deposit_paths(delays[some], gains[some], view)
        shape_pulses(view, decay, banks, sizes, out[place])
