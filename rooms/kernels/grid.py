"""March the wave equation over a grid of cells."""

from math import atan2, sqrt

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def winding_numbers(points, corners):
    """Return how often triangles (T, 3, 3) wind around each point (N, 3).

    By their solid angles (van Oosterom & Strackee, IEEE Trans. Biomed. Eng. 30,
    125 (1983)); ±1 inside a closed mesh, 0 outside.
    """
    turns = np.zeros(len(points))
    for n in range(len(points)):
        total = 0.0
        for t in range(len(corners)):
            ax = corners[t, 0, 0] - points[n, 0]
            ay = corners[t, 0, 1] - points[n, 1]
            az = corners[t, 0, 2] - points[n, 2]
            bx = corners[t, 1, 0] - points[n, 0]
            by = corners[t, 1, 1] - points[n, 1]
            bz = corners[t, 1, 2] - points[n, 2]
            cx = corners[t, 2, 0] - points[n, 0]
            cy = corners[t, 2, 1] - points[n, 1]
            cz = corners[t, 2, 2] - points[n, 2]
            la = sqrt(ax * ax + ay * ay + az * az)
            lb = sqrt(bx * bx + by * by + bz * bz)
            lc = sqrt(cx * cx + cy * cy + cz * cz)
            top = ax * (by * cz - bz * cy)
            top += ay * (bz * cx - bx * cz)
            top += az * (bx * cy - by * cx)
            bottom = la * lb * lc
            bottom += (ax * bx + ay * by + az * bz) * lc
            bottom += (bx * cx + by * cy + bz * cz) * la
            bottom += (cx * ax + cy * ay + cz * az) * lb
            total += 2 * atan2(top, bottom)
        turns[n] = total / (4 * np.pi)
    return turns


@njit(cache=True, nogil=True, fastmath=True)
def _march_row(p, west, east, south, north, ratios, center, left, before):
    """Advance one row of cells in place; written without branches to vectorise."""
    rx, ry, rz = ratios
    for k in range(1, len(p) - 1):
        sides = rx * (west[k] + east[k]) + ry * (south[k] + north[k])
        sides += rz * (p[k - 1] + p[k + 1])
        before[k] = left[k] * (center[k] * p[k] + sides) - (2 * left[k] - 1) * before[k]


@njit(cache=True, nogil=True, fastmath=True)
def march(center, ratios, left, source, drive, ears, weights, steps):
    """Return the pressure at listeners after a unit impulse, shape (L, steps).

    A leapfrog scheme on cells with six neighbours: cells outside the air pass no
    flow, and a cell at a wall loses energy by the wall's admittance
    (K. Kowalczyk, M. van Walstijn, IEEE TASLP 19(1), 34 (2011), locally reacting
    surfaces).

    Parameters
    ----------
    center : ndarray, shape (nx, ny, nz)
        2 less the ratios of all neighbours in the air; any value outside. Cells
        outside the air stay at zero pressure, so nothing flows to them.
    ratios : ndarray, shape (3,)
        Squared (c dt / h) along each axis; their sum must not exceed 1.
    left : ndarray, shape (nx, ny, nz)
        1 / (1 + loss), with the loss half the Courant number times the admittance
        over all walls of a cell; 0 outside, where pressure then stays zero.
    source : ndarray, shape (cells, 3)
        Cells that the emitter drives, with the shares `drive`.
    ears, weights : ndarray, shape (L, cells, 3), (L, cells)
        Cells and shares that each listener hears.
    steps : int
        Number of time steps.
    """
    nx, ny, nz = center.shape
    now, before = np.zeros((nx, ny, nz)), np.zeros((nx, ny, nz))
    heard = np.zeros((len(ears), steps))
    rx, ry, rz = ratios
    for step in range(steps):
        for i in range(1, nx - 1):
            for j in range(1, ny - 1):
                _march_row(
                    now[i, j],
                    now[i - 1, j],
                    now[i + 1, j],
                    now[i, j - 1],
                    now[i, j + 1],
                    (rx, ry, rz),
                    center[i, j],
                    left[i, j],
                    before[i, j],
                )
        if step == 0:
            for n in range(len(source)):
                i, j, k = source[n]
                before[i, j, k] += drive[n] * left[i, j, k]
        now, before = before, now
        for ear in range(len(ears)):
            total = 0.0
            for n in range(ears.shape[1]):
                i, j, k = ears[ear, n]
                total += weights[ear, n] * now[i, j, k]
            heard[ear, step] = total
    return heard
