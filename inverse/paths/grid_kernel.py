"""Images of a box laid on a grid of moments, compiled.

A pulse whose taps are polynomials in the fraction of a sample is the sum over moments
of a grid, filtered by that moment's taps. Long pulses are rendered faster so: an image
costs its moments, not its taps.
"""

from math import floor, sqrt

import numpy as np
from numba import njit

from inverse.paths.lattice_kernel import NEAREST_M, path_gain, wall_counts

__all__ = ["lay_rows"]


@njit(cache=True, fastmath=True)
def lay_rows(
    emitters, listeners, turns, hearing, low, high, scale, latency, reach, walls,
    emitting, listening, least, most, grid,
):  # fmt: skip
    """Add the images of all rows to grids of moments.

    Parameters are those of `render_rows`, but for the grid, shape
    (rows, moments, n): an arrival lies at the floor of its sample, times the powers of
    2 f - 1 of its fraction f.
    """
    first, second = np.empty(len(emitting)), np.empty(len(listening))
    size = high - low
    moments, length_n = grid.shape[1], grid.shape[2]
    most_x = int(reach / (2 * size[0])) + 2
    most_y = int(reach / (2 * size[1])) + 2
    most_z = int(reach / (2 * size[2])) + 2
    square = reach * reach
    for row in range(len(emitters)):
        e, h = emitters[row] - low, listeners[row] - low
        for mx in range(-most_x, most_x + 1):
            for px in range(2):
                vx = h[0] - (1 - 2 * px) * e[0] - 2 * mx * size[0]
                ax, bx = wall_counts(mx, px)
                if vx * vx > square or ax + bx > most:
                    continue
                gx = walls[0] ** ax * walls[1] ** bx
                for my in range(-most_y, most_y + 1):
                    for py in range(2):
                        vy = h[1] - (1 - 2 * py) * e[1] - 2 * my * size[1]
                        ay, by = wall_counts(my, py)
                        left = square - vx * vx - vy * vy
                        flat = ax + bx + ay + by
                        if left < 0.0 or flat > most:
                            continue
                        gy = gx * walls[2] ** ay * walls[3] ** by
                        for mz in range(-most_z, most_z + 1):
                            for pz in range(2):
                                az, bz = wall_counts(mz, pz)
                                order = flat + az + bz
                                if order > most or order < least:
                                    continue
                                vz = h[2] - (1 - 2 * pz) * e[2] - 2 * mz * size[2]
                                if vz * vz > left:
                                    continue
                                length = sqrt(vx * vx + vy * vy + vz * vz)
                                length = max(length, NEAREST_M)
                                at = length * scale + latency
                                place = floor(at)
                                if place >= length_n or place < 0:
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
                                x = 2.0 * (at - place) - 1.0
                                for moment in range(moments):
                                    grid[row, moment, place] += gain
                                    gain *= x
