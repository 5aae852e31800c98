"""Evaluate gain patterns inside compiled loops."""

import numpy as np
from numba import njit

from rir.harmonics_kernel import order_of, turned_harmonics


@njit(cache=True, nogil=True)
def pattern_gains(turn, coefficients, ux, uy, uz, basis, out):
    """Write the gain of each band towards a room direction into `out`.

    `basis` takes the harmonics of the direction in the device's frame.
    """
    lanes, count = coefficients.shape
    order = order_of(count)
    turned_harmonics(turn, ux, uy, uz, order, basis)
    out[:] = 0.0
    for m in range(order + 1):
        for degree in range(m, order + 1):
            center = degree * degree + degree
            for lane in range(lanes):
                out[lane] += coefficients[lane, center + m] * basis[center + m]
                if m:
                    out[lane] += coefficients[lane, center - m] * basis[center - m]


@njit(cache=True, nogil=True)
def looked_up(turn, side, ux, uy, uz):
    """Return the row of a table of gains for a room direction.

    Tables hold the six faces of a cube around the device, each cut into `side` times
    `side` cells; see `cell_directions`.
    """
    x = turn[0, 0] * ux + turn[0, 1] * uy + turn[0, 2] * uz
    y = turn[1, 0] * ux + turn[1, 1] * uy + turn[1, 2] * uz
    z = turn[2, 0] * ux + turn[2, 1] * uy + turn[2, 2] * uz
    ax, ay, az = abs(x), abs(y), abs(z)
    if ax >= ay and ax >= az:
        face, most, one, other = 0, x, y, z
    elif ay >= az:
        face, most, one, other = 2, y, z, x
    else:
        face, most, one, other = 4, z, x, y
    half = 0.5 * side / max(abs(most), 1e-12)
    i = min(int(half * one + 0.5 * side), side - 1)
    j = min(int(half * other + 0.5 * side), side - 1)
    if most < 0.0:
        face += 1
    return (face * side + max(i, 0)) * side + max(j, 0)


def cell_directions(side):
    """Return the unit vectors of the middles of all cells, (6 side², 3)."""
    middle = (np.arange(side) + 0.5) * 2 / side - 1
    one, other = (part.ravel() for part in np.meshgrid(middle, middle, indexing="ij"))
    faces = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            way = np.stack([np.full(len(one), sign), one, other], axis=1)
            faces.append(np.roll(way, axis, axis=1))
    ways = np.concatenate(faces)
    return ways / np.linalg.norm(ways, axis=1, keepdims=True)
