"""What stands in the way of mirror paths, voxel by voxel, compiled.

A way is walked straight through the unfolded room, whose voxels are mirrored with it;
sums of lengths are the same from either end.
"""

from math import floor

import numpy as np
from numba import njit

from inverse.bands.band_arrivals import paint, reflected
from inverse.bands.band_kernel import image_arrays, list_images, pattern_gain

__all__ = ["add_shadows", "cross_voxels", "part_paths", "trace_paths"]

MOST_SHADED = 512  # images of a pair; all that reflect three times at most are 63
MOST_CROSSED = 2048  # voxels of 0.25 m on a way: 200 m and more
LEAST_DEPTH = 1e-4  # nepers: less is no shadow


@njit(cache=True, fastmath=True)
def _mirrored(number, count):
    """Return the voxel of the room an unfolded one is a mirror image of."""
    turned = number % (2 * count)
    return turned if turned < count else 2 * count - 1 - turned


@njit(cache=True, fastmath=True)
def cross_voxels(start, way, step, shape, voxels, lengths):
    """List voxels on a way of an unfolded room and how far it goes through each.

    `start` is relative to the low corner, `way` the whole way; returns the count.
    """
    whole = np.sqrt(way[0] ** 2 + way[1] ** 2 + way[2] ** 2)
    at, ahead, apart = np.empty(3, np.int64), np.empty(3), np.empty(3)
    forward = np.empty(3, np.int64)
    for axis in range(3):
        at[axis] = floor(start[axis] / step[axis])
        forward[axis] = 1 if way[axis] > 0 else -1
        speed = abs(way[axis])
        apart[axis] = step[axis] / speed if speed > 1e-12 else 1e9
        edge = at[axis] + 1 if way[axis] > 0 else at[axis]
        gap = abs(edge * step[axis] - start[axis])
        ahead[axis] = gap / speed if speed > 1e-12 else 1e9
    gone, n = 0.0, 0
    while gone < 1.0 and n < len(voxels):
        axis = 0
        if ahead[1] < ahead[axis]:
            axis = 1
        if ahead[2] < ahead[axis]:
            axis = 2
        then = min(ahead[axis], 1.0)
        x, y = _mirrored(at[0], shape[0]), _mirrored(at[1], shape[1])
        z = _mirrored(at[2], shape[2])
        voxels[n] = (x * shape[1] + y) * shape[2] + z
        lengths[n] = (then - gone) * whole
        n += 1
        gone = then
        at[axis] += forward[axis]
        ahead[axis] += apart[axis]
    return n


@njit(cache=True, fastmath=True)
def _value(band, n, at, images, interior, kernels):
    """Return amplitude and phase of an image that arrives at `at` in one band."""
    away, _, counts, leaving, arriving = images
    length = away[n, 3]
    gain = np.exp(-interior.loss[band] * length) / length
    gain *= pattern_gain(interior.emitting[band], leaving[n])
    gain *= pattern_gain(interior.listening[band], arriving[n])
    factor = 1.0 + 0.0j
    for wall in range(6):
        cosine = abs(away[n, wall // 2]) / length
        one = reflected(interior.walls[band, wall], interior.angled, cosine)
        for _ in range(counts[n, wall]):
            factor *= one
    angle = kernels.turns[band] * at
    return gain * factor * complex(np.cos(angle), -np.sin(angle))


@njit(cache=True, fastmath=True)
def add_shadows(ends, geometry, interior, kernels, chosen, step, shape, depths, out):
    """Take from envelopes (rows, total) what voxels keep of images up to an order.

    `depths` (bands, voxels) are nepers a metre; other parameters are those of
    `inverse.bands.band_kernel`.
    """
    images = image_arrays(
        MOST_SHADED, interior.emitting.shape[1], interior.listening.shape[1]
    )
    away, lattice = images[0], images[1]
    voxels, lengths = np.empty(MOST_CROSSED, np.int64), np.empty(MOST_CROSSED)
    for row in range(len(out)):
        start = ends[0][row] - geometry[0]
        found = list_images(row, ends, geometry, interior.least, interior.order, images)
        for n in range(found):
            way = away[n, :3] * lattice[n, 3:]
            crossed = cross_voxels(start, way, step, shape, voxels, lengths)
            at = away[n, 3] * geometry[2] + geometry[3]
            for band in range(len(kernels.starts)):
                if not chosen[band]:
                    continue
                depth = 0.0
                for k in range(crossed):
                    depth += depths[band, voxels[k]] * lengths[k]
                if depth < LEAST_DEPTH:
                    continue
                value = _value(band, n, at, images, interior, kernels)
                value *= np.exp(-depth) - 1.0
                first, size = kernels.starts[band], kernels.lengths[band]
                here = out[row, first : first + size]
                paint(value, at, band, kernels, size, here)


@njit(cache=True, fastmath=True)
def part_paths(ends, geometry, interior, kernels, most, band, columns):
    """Write what each mirror path up to an order sends to one band.

    `columns` (rows, paths, samples) are filled.
    """
    images = image_arrays(
        columns.shape[1], interior.emitting.shape[1], interior.listening.shape[1]
    )
    for row in range(len(columns)):
        found = list_images(row, ends, geometry, 0, most, images)
        for n in range(found):
            at = images[0][n, 3] * geometry[2] + geometry[3]
            value = _value(band, n, at, images, interior, kernels)
            paint(value, at, band, kernels, kernels.lengths[band], columns[row, n])


@njit(cache=True, fastmath=True)
def trace_paths(ends, geometry, most, step, shape, ways, bounces, cells, spans):
    """Write the voxels on the mirror paths up to an order, as `part_paths` lists them.

    `ways` (rows,) takes the number of paths, `bounces` (rows, paths) of walls,
    `cells` and `spans` (rows, paths, n) voxels, -1 behind the last, and metres in
    each.
    """
    images = image_arrays(cells.shape[1], 1, 1)
    away, lattice, counts = images[0], images[1], images[2]
    cells[:] = -1
    for row in range(len(cells)):
        start = ends[0][row] - geometry[0]
        ways[row] = list_images(row, ends, geometry, 0, most, images)
        for n in range(ways[row]):
            bounces[row, n] = counts[n].sum()
            way = away[n, :3] * lattice[n, 3:]
            cross_voxels(start, way, step, shape, cells[row, n], spans[row, n])
