"""Compiled: what a ray asks where it meets a surface."""

import numpy as np
from numba import njit

__all__ = ["CLOSEST", "draw", "patch_at", "scattered_way"]

CLOSEST = 1e-4
"""Least square of a distance over a cosine [m²]: places that touch a surface."""

_STEP = np.uint64(0x9E3779B97F4A7C15)
_MIX_ONE = np.uint64(0xBF58476D1CE4E5B9)
_MIX_TWO = np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31, _S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)


@njit(cache=True, nogil=True, inline="always")
def draw(state):
    """Return the next state and a number in 0…1.

    G. Steele, D. Lea, C. Flood, OOPSLA 2014: SplitMix.
    """
    state = state + _STEP
    z = (state ^ (state >> _S30)) * _MIX_ONE
    z = (z ^ (z >> _S27)) * _MIX_TWO
    z = z ^ (z >> _S31)
    return state, (z >> _S11) * (1.0 / 9007199254740992.0)


@njit(cache=True, nogil=True, inline="always")
def patch_at(records, face, inward, px, py, pz):
    """Return the patch of a triangle at a point of it.

    `inward` is the cosine between the way of the ray and the triangle's normal; for
    `records` see `rooms.rays.patches`.
    """
    patch = int(records[face, 5 if inward > 0.0 else 4])
    wide, deep = int(records[face, 6]), int(records[face, 7])
    if wide > 0:
        u = px * records[face, 8] + py * records[face, 9]
        u += pz * records[face, 10] + records[face, 11]
        v = px * records[face, 12] + py * records[face, 13]
        v += pz * records[face, 14] + records[face, 15]
        i = min(max(int(u), 0), wide - 1)
        if deep < 0:
            patch += -i * deep + min(max(int(v), 0), -deep - 1)
        else:
            j = min(max(int(v), 0), deep - 1 - i)
            upper = u - i + v - j > 1.0 and i + j < deep - 1
            patch += i * (2 * deep - i) + 2 * j + int(upper)
    return patch


@njit(cache=True, nogil=True, inline="always")
def scattered_way(state, nx, ny, nz):
    """Return the next state and a direction by Lambert's law around a normal.

    A point on the unit sphere around the normal's tip: G. Marsaglia, Ann. Math.
    Statist. 43, 645 (1972).
    """
    u, v, square = 0.0, 0.0, 2.0
    while square >= 1.0:
        # the next number and the bits below it
        state, u = draw(state)
        v = u * 67108864.0
        u, v = 2.0 * u - 1.0, 2.0 * (v - np.floor(v)) - 1.0
        square = u * u + v * v
    flat = 2.0 * np.sqrt(1.0 - square)
    wx = nx + flat * u
    wy = ny + flat * v
    wz = nz + 1.0 - 2.0 * square
    size = np.sqrt(wx * wx + wy * wy + wz * wz)
    if size < 1e-9:
        wx, wy, wz, size = nx, ny, nz, 1.0
    size = 1.0 / size
    return state, wx * size, wy * size, wz * size
