"""Mirror images of a box in half octaves, compiled.

A wall reflects by its admittance b over that of air, R = (cos - b) / (cos + b), or by
one factor at all angles. The same image serves all bands, so images are listed first.

All routines of this folder take the same tuples: `ends` (emitters, listeners and the
turns into both devices' frames, as of `BoxRoom.ends`), `geometry` (low, high, scale,
latency, reach, as of `BoxRoom.geometry`), an `Interior` and the `Kernels` of the bands.
"""

from math import sqrt

import numpy as np
from numba import njit

from inverse.bands.band_arrivals import (
    arrival_arrays,
    bounce,
    place_arrivals,
    planar,
    summed_arrivals,
)
from inverse.paths.lattice_kernel import (
    NEAREST_M,
    wall_counts,
)
from rir.harmonics_kernel import order_of, turned_harmonics

__all__ = ["image_arrays", "list_images", "render_bands"]

LOSS, PHASE, PATTERN = 12, 13, 14
"""Columns of a band: walls (real and imaginary by turns), air, phase, patterns."""


@njit(cache=True, fastmath=True)
def image_arrays(room_for, leaving, arriving):
    """Return arrays for as many images, and for as many harmonics of both devices.

    The way to the listener and its length, integers and signs of the lattice,
    reflections by wall, and the harmonics of both directions.
    """
    return (
        np.empty((room_for, 4)),
        np.empty((room_for, 6)),
        np.empty((room_for, 6), dtype=np.int64),
        np.empty((room_for, leaving)),
        np.empty((room_for, arriving)),
    )


@njit(cache=True, fastmath=True)
def list_images(row, ends, geometry, least, most, images):
    """List the images of one pair in `image_arrays`; return how many there are."""
    emitters, listeners, turns, hearing = ends
    low, high, _, _, reach = geometry
    away, lattice, counts, leaving, arriving = images
    e, h, size = emitters[row] - low, listeners[row] - low, high - low
    turn, ear = turns[row], hearing[row]
    most_x = int(reach / (2 * size[0])) + 2
    most_y = int(reach / (2 * size[1])) + 2
    most_z = int(reach / (2 * size[2])) + 2
    emitting, listening = order_of(leaving.shape[1]), order_of(arriving.shape[1])
    n = 0
    for mx in range(-most_x, most_x + 1):
        for px in range(2):
            vx = h[0] - (1 - 2 * px) * e[0] - 2 * mx * size[0]
            ax, bx = wall_counts(mx, px)
            if vx * vx > reach * reach or ax + bx > most:
                continue
            for my in range(-most_y, most_y + 1):
                for py in range(2):
                    vy = h[1] - (1 - 2 * py) * e[1] - 2 * my * size[1]
                    ay, by = wall_counts(my, py)
                    within = reach * reach - vx * vx - vy * vy
                    if within < 0.0 or ax + bx + ay + by > most:
                        continue
                    for mz in range(-most_z, most_z + 1):
                        for pz in range(2):
                            vz = h[2] - (1 - 2 * pz) * e[2] - 2 * mz * size[2]
                            az, bz = wall_counts(mz, pz)
                            order = ax + bx + ay + by + az + bz
                            if vz * vz > within or order > most or order < least:
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
def pattern_gain(coefficients, basis):
    """Return a pattern's gain where its harmonics have given values."""
    total = 0.0
    for k in range(len(coefficients)):
        total += coefficients[k] * basis[k]
    return total


@njit(cache=True, fastmath=True)
def pattern_gains(found, band, images, interior):
    """Return the gains of both devices towards all images in one band."""
    return (
        np.dot(images[3][:found], interior.emitting[band]),
        np.dot(images[4][:found], interior.listening[band]),
    )


@njit(cache=True, fastmath=True)
def render_bands(ends, geometry, interior, kernels, room_for, chosen, out):
    """Add the images of all rows to the `chosen` bands of (rows, total) envelopes."""
    images = image_arrays(
        room_for, interior.emitting.shape[1], interior.listening.shape[1]
    )
    arrivals = arrival_arrays(room_for)
    values = arrivals[3]
    shapes, wide = planar(kernels.taps, kernels.widths)
    spare = np.empty((2, kernels.lengths.max() + shapes.shape[3]))
    for row in range(len(out)):
        found = list_images(row, ends, geometry, interior.least, interior.order, images)
        bits = bounce(found, images, arrivals)
        for band in range(len(kernels.starts)):
            if not chosen[band]:
                continue
            size, start = kernels.lengths[band], kernels.starts[band]
            place_arrivals(
                found, bits, band, images, geometry, interior, kernels, arrivals
            )
            leave, arrive = pattern_gains(found, band, images, interior)
            for n in range(found):
                values[n] *= leave[n] * arrive[n]
            here = spare[:, : size + shapes.shape[3]]
            summed_arrivals(found, arrivals, shapes[band], wide[band], size, here)
            for m in range(size):
                out[row, start + m] += complex(here[0, m], here[1, m])
