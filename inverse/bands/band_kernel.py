"""Mirror images of a box in half octaves, compiled.

A wall reflects by its admittance b over that of air, R = (cos - b) / (cos + b), or by
one factor at all angles. The same image serves all bands, so images are listed first.
"""

from math import sqrt

import numpy as np
from numba import njit

from inverse.bands.band_arrivals import (
    BITS,
    add_arrivals,
    bounce,
    folded,
    place_arrivals,
    planar,
)
from inverse.paths.lattice_kernel import (
    NEAREST_M,
    _counts,
)
from rir.harmonics_kernel import order_of, turned_harmonics

__all__ = ["list_images", "render_bands"]

LOSS, PHASE, PATTERN = 12, 13, 14
"""Columns of a band: walls (real and imaginary by turns), air, phase, patterns."""


@njit(cache=True, fastmath=True)
def list_images(
    e, h, turn, ear, low, high, reach, least, most, away, lattice, counts, leaving,
    arriving,
):  # fmt: skip
    """List the images of one pair and return how many there are.

    `away` takes the way to the listener and its length, `lattice` the integers and
    signs of each image, `counts` reflections by wall, `leaving` and `arriving` the
    harmonics of both directions.
    """
    size = high - low
    most_x = int(reach / (2 * size[0])) + 2
    most_y = int(reach / (2 * size[1])) + 2
    most_z = int(reach / (2 * size[2])) + 2
    emitting, listening = order_of(leaving.shape[1]), order_of(arriving.shape[1])
    n = 0
    for mx in range(-most_x, most_x + 1):
        for px in range(2):
            vx = h[0] - (1 - 2 * px) * e[0] - 2 * mx * size[0]
            ax, bx = _counts(mx, px)
            if vx * vx > reach * reach or ax + bx > most:
                continue
            for my in range(-most_y, most_y + 1):
                for py in range(2):
                    vy = h[1] - (1 - 2 * py) * e[1] - 2 * my * size[1]
                    ay, by = _counts(my, py)
                    left = reach * reach - vx * vx - vy * vy
                    if left < 0.0 or ax + bx + ay + by > most:
                        continue
                    for mz in range(-most_z, most_z + 1):
                        for pz in range(2):
                            vz = h[2] - (1 - 2 * pz) * e[2] - 2 * mz * size[2]
                            az, bz = _counts(mz, pz)
                            order = ax + bx + ay + by + az + bz
                            if vz * vz > left or order > most or order < least:
                                continue
                            if n == len(away):
                                return n
                            length = sqrt(vx * vx + vy * vy + vz * vz)
                            length = max(length, NEAREST_M)
                            away[n, 0], away[n, 1], away[n, 2] = vx, vy, vz
                            away[n, 3] = length
                            lattice[n, 0], lattice[n, 1], lattice[n, 2] = mx, my, mz
                            lattice[n, 3] = 1.0 - 2.0 * px
                            lattice[n, 4] = 1.0 - 2.0 * py
                            lattice[n, 5] = 1.0 - 2.0 * pz
                            counts[n, 0], counts[n, 1] = ax, bx
                            counts[n, 2], counts[n, 3] = ay, by
                            counts[n, 4], counts[n, 5] = az, bz
                            ux, uy, uz = vx / length, vy / length, vz / length
                            turned_harmonics(
                                turn,
                                (1 - 2 * px) * ux,
                                (1 - 2 * py) * uy,
                                (1 - 2 * pz) * uz,
                                emitting,
                                leaving[n],
                            )
                            turned_harmonics(ear, -ux, -uy, -uz, listening, arriving[n])
                            n += 1
    return n


@njit(cache=True, fastmath=True)
def _dot(coefficients, basis):
    total = 0.0
    for k in range(len(coefficients)):
        total += coefficients[k] * basis[k]
    return total


@njit(cache=True, fastmath=True)
def _add_turned(row, columns, a, b):
    """Add (a + ib) times complex columns; both halves lie in one row."""
    for k in range(len(row)):
        row[k] += a * columns[0, k] + b * columns[1, k]


@njit(cache=True, fastmath=True)
def _complete(columns):
    """Fill the turned copy of columns whose halves are real and imaginary."""
    count = columns.shape[1] // 2
    for k in range(count):
        columns[1, k] = -columns[0, count + k]
        columns[1, count + k] = columns[0, k]


@njit(cache=True, fastmath=True)
def render_bands(
    emitters, listeners, turns, hearing, low, high, scale, latency, reach, walls,
    angled, loss, emitting, listening, least, most, starts, lengths, turn, rates, taps,
    widths, room_for, chosen, out,
):  # fmt: skip
    """Add the images of all rows to the `chosen` bands of (rows, total) envelopes."""
    away, lattice = np.empty((room_for, 4)), np.empty((room_for, 6))
    counts = np.empty((room_for, 6), dtype=np.int64)
    leaving = np.empty((room_for, emitting.shape[1]))
    arriving = np.empty((room_for, listening.shape[1]))
    cosines, bounces = np.empty((3, room_for)), np.empty((3, 2 + BITS, room_for))
    mirrored, values = np.empty((4, room_for)), np.empty(room_for, dtype=np.complex128)
    places, parts = np.empty((room_for, 2), dtype=np.int64), np.empty(room_for)
    fractions = taps.shape[1] - 1
    shapes, wide = planar(taps, widths)
    spare = np.empty((2, lengths.max() + shapes.shape[3]))
    for row in range(len(emitters)):
        found = list_images(
            emitters[row] - low, listeners[row] - low, turns[row], hearing[row], low,
            high, reach, least, most, away, lattice, counts, leaving, arriving,
        )  # fmt: skip
        bits = bounce(found, away, counts, cosines, bounces)
        for band in range(len(starts)):
            if not chosen[band]:
                continue
            size = lengths[band]
            place_arrivals(
                found, away, cosines, bounces, bits, walls[band], angled, loss[band],
                scale, latency, turn[band], rates[band], size, widths[band] // 2 - 1,
                fractions, mirrored, values, places, parts,
            )  # fmt: skip
            said = np.dot(leaving[:found], emitting[band])
            heard = np.dot(arriving[:found], listening[band])
            for n in range(found):
                values[n] *= said[n] * heard[n]
            here = spare[:, : size + shapes.shape[3]]
            here[:] = 0.0
            add_arrivals(found, values, places, parts, shapes[band], wide[band], here)
            folded(here, size)
            for m in range(size):
                out[row, starts[band] + m] += complex(here[0, m], here[1, m])
