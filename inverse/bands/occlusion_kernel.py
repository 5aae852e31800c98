"""What stands in the way of mirror paths, voxel by voxel, compiled.

A way is walked straight through the unfolded room, whose voxels are mirrored with it;
sums of lengths are the same from either end.
"""

from math import floor

import numpy as np
from numba import njit

from inverse.bands.band_kernel import _dot, list_images

__all__ = ["add_shadows", "cross_voxels", "part_paths", "trace_paths"]


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
def _walls(walls, angled, away, counts):
    """Return the product of all reflections of an image in one band."""
    factor = 1.0 + 0.0j
    for wall in range(6):
        one = walls[wall]
        if angled:
            cosine = abs(away[wall // 2]) / away[3]
            one = (cosine - one) / (cosine + one)
        for _ in range(counts[wall]):
            factor *= one
    return factor


@njit(cache=True, fastmath=True)
def _value(band, n, away, counts, leaving, arriving, walls, angled, loss, emitting,
           listening):  # fmt: skip
    """Return amplitude and reflections of an image in one band, without phase."""
    length = away[n, 3]
    gain = np.exp(-loss[band] * length) / length
    gain *= _dot(emitting[band], leaving[n])
    gain *= _dot(listening[band], arriving[n])
    return gain * _walls(walls[band], angled, away[n], counts[n])


@njit(cache=True, fastmath=True)
def add_shadows(
    emitters, listeners, turns, hearing, low, high, scale, latency, reach, walls,
    angled, loss, emitting, listening, least, most, starts, sizes, turn, rates, taps,
    widths, chosen, step, shape, depths, out,
):  # fmt: skip
    """Take from envelopes (rows, total) what voxels keep of images up to an order.

    `depths` (bands, voxels) are nepers a metre.
    """
    room_for = 512
    away, lattice = np.empty((room_for, 4)), np.empty((room_for, 6))
    counts = np.empty((room_for, 6), dtype=np.int64)
    leaving = np.empty((room_for, emitting.shape[1]))
    arriving = np.empty((room_for, listening.shape[1]))
    voxels, lengths = np.empty(2048, np.int64), np.empty(2048)
    fractions = taps.shape[1] - 1
    for row in range(len(emitters)):
        start = emitters[row] - low
        found = list_images(
            start, listeners[row] - low, turns[row], hearing[row], low, high, reach,
            least, most, away, lattice, counts, leaving, arriving,
        )  # fmt: skip
        for n in range(found):
            way = away[n, :3] * lattice[n, 3:]
            crossed = cross_voxels(start, way, step, shape, voxels, lengths)
            for band in range(len(starts)):
                if not chosen[band]:
                    continue
                depth = 0.0
                for k in range(crossed):
                    depth += depths[band, voxels[k]] * lengths[k]
                if depth < 1e-4:
                    continue
                value = _value(
                    band, n, away, counts, leaving, arriving, walls, angled, loss,
                    emitting, listening,
                )  # fmt: skip
                at = away[n, 3] * scale + latency
                angle = turn[band] * at
                value *= (np.exp(-depth) - 1.0) * complex(np.cos(angle), -np.sin(angle))
                place = at * rates[band]
                base = floor(place)
                fine = (place - base) * fractions
                tick = int(fine)
                part = fine - tick
                first = base - (widths[band] // 2 - 1)
                for tap in range(widths[band]):
                    wave = taps[band, tick, tap]
                    wave += part * (taps[band, tick + 1, tap] - wave)
                    m = starts[band] + (first + tap) % sizes[band]
                    out[row, m] += value * wave


@njit(cache=True, fastmath=True)
def part_paths(
    emitters, listeners, turns, hearing, low, high, scale, latency, reach, walls,
    angled, loss, emitting, listening, most, turn, rates, taps, widths, band, period,
    columns,
):  # fmt: skip
    """Write what each mirror path up to an order sends to one band.

    `columns` (rows, paths, samples) are filled; `period` is the band's length.
    """
    room_for = columns.shape[1]
    away, lattice = np.empty((room_for, 4)), np.empty((room_for, 6))
    counts = np.empty((room_for, 6), dtype=np.int64)
    leaving = np.empty((room_for, emitting.shape[1]))
    arriving = np.empty((room_for, listening.shape[1]))
    fractions = taps.shape[1] - 1
    for row in range(len(emitters)):
        found = list_images(
            emitters[row] - low, listeners[row] - low, turns[row], hearing[row], low,
            high, reach, 0, most, away, lattice, counts, leaving, arriving,
        )  # fmt: skip
        for n in range(found):
            value = _value(
                band, n, away, counts, leaving, arriving, walls, angled, loss,
                emitting, listening,
            )  # fmt: skip
            at = away[n, 3] * scale + latency
            angle = turn[band] * at
            value *= complex(np.cos(angle), -np.sin(angle))
            place = at * rates[band]
            base = floor(place)
            fine = (place - base) * fractions
            tick = int(fine)
            part = fine - tick
            first = base - (widths[band] // 2 - 1)
            for tap in range(widths[band]):
                wave = taps[band, tick, tap]
                wave += part * (taps[band, tick + 1, tap] - wave)
                m = (first + tap) % period
                if m < columns.shape[2]:
                    columns[row, n, m] += value * wave


@njit(cache=True, fastmath=True)
def trace_paths(
    emitters, listeners, turns, hearing, low, high, reach, most, step, shape, ways,
    bounces, cells, spans,
):  # fmt: skip
    """Write the voxels on the mirror paths up to an order, as `part_paths` lists them.

    `ways` (rows,) takes the number of paths, `bounces` (rows, paths) of walls,
    `cells` and `spans` (rows, paths, n) voxels, -1 behind the last, and metres in
    each.
    """
    room_for = cells.shape[1]
    away, lattice = np.empty((room_for, 4)), np.empty((room_for, 6))
    counts = np.empty((room_for, 6), dtype=np.int64)
    leaving, arriving = np.empty((room_for, 1)), np.empty((room_for, 1))
    cells[:] = -1
    for row in range(len(emitters)):
        start = emitters[row] - low
        ways[row] = list_images(
            start, listeners[row] - low, turns[row], hearing[row], low, high, reach,
            0, most, away, lattice, counts, leaving, arriving,
        )  # fmt: skip
        for n in range(ways[row]):
            bounces[row, n] = counts[n].sum()
            way = away[n, :3] * lattice[n, 3:]
            cross_voxels(start, way, step, shape, cells[row, n], spans[row, n])
