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
def _advance(
    now, west, east, south, north, below, above,
    to_west, to_east, to_south, to_north, to_below, to_above,
    center, left, before,
):  # fmt: skip
    """Advance all cells in place; one slice for each operand, so that it vectorises."""
    for n in range(len(now)):
        flow = to_west[n] * west[n] + to_east[n] * east[n]
        flow += to_south[n] * south[n] + to_north[n] * north[n]
        flow += to_below[n] * below[n] + to_above[n] * above[n]
        kept = (2 * left[n] - 1) * before[n]
        before[n] = left[n] * (center[n] * now[n] + flow) - kept


@njit(cache=True, nogil=True, fastmath=True)
def march(center, left, links, strides, source, drive, ears, weights, steps):
    """Return what listeners hear after a unit impulse, shape (L, steps).

    A leapfrog scheme on cells with six neighbours: cells outside the air pass no
    flow, and a cell at a wall loses energy by the wall's admittance
    (K. Kowalczyk, M. van Walstijn, IEEE TASLP 19(1), 34 (2011), locally reacting
    surfaces). Cells that a wall cuts have the volume and the openings that are left
    (D. Botteldooren, JASA 95, 2313 (1994)). The unknown is the pressure times the root
    of a cell's share of air: so the matrix of links is symmetric, and the scheme
    reciprocal.

    Parameters
    ----------
    center : ndarray, shape (cells,)
        2 less the sum of what all neighbours in the air take. The cells lie in rows,
        with a frame of cells that hold no air.
    left : ndarray, shape (cells,)
        1 / (1 + loss), with the loss half the Courant number times the admittance
        over all walls of a cell.
    links : ndarray, shape (3, cells)
        What flows from a cell to the next along each axis; 0 where nothing does.
    strides : tuple of int
        How far apart neighbours along x and y are; those along z are 1 apart.
    source : ndarray, shape (n,)
        Cells that the emitter drives, with the shares `drive`.
    ears, weights : ndarray, shape (L, n)
        Cells and shares that each listener hears.
    steps : int
        Number of time steps.
    """
    far, wide = strides
    first, last = far, len(center) - far
    now, before = np.zeros(len(center)), np.zeros(len(center))
    heard = np.zeros((len(ears), steps))
    x, y, z = links[0], links[1], links[2]  # rows known to lie in one piece
    for step in range(steps):
        _advance(
            now[first:last],
            now[first - far : last - far], now[first + far : last + far],
            now[first - wide : last - wide], now[first + wide : last + wide],
            now[first - 1 : last - 1], now[first + 1 : last + 1],
            x[first - far : last - far], x[first:last],
            y[first - wide : last - wide], y[first:last],
            z[first - 1 : last - 1], z[first:last],
            center[first:last], left[first:last], before[first:last],
        )  # fmt: skip
        if step == 0:
            for n in range(len(source)):
                before[source[n]] += drive[n] * left[source[n]]
        now, before = before, now
        for ear in range(len(ears)):
            total = 0.0
            for n in range(ears.shape[1]):
                total += weights[ear, n] * now[ears[ear, n]]
            heard[ear, step] = total
    return heard
