"""Mirror paths over listed walls and their derivatives, compiled."""

from math import sqrt

import numpy as np
from numba import njit

from inverse.paths.lattice_kernel import (
    NEAREST_M,
    add_pulse,
    add_row,
    fill_pulse,
    fill_slope,
    path_gain,
)

__all__ = ["accumulate_paths", "lay_paths", "render_paths"]


@njit(cache=True, fastmath=True)
def _laid(emitter, listener, walls, count, planes, images, heights, leave, come):
    """Follow one sequence of mirrors; return the length of its path."""
    for axis in range(3):
        images[0, axis] = emitter[axis]
    for k in range(count):
        p = walls[k]
        height = -planes[p, 3]
        for axis in range(3):
            height += planes[p, axis] * images[k, axis]
        heights[k] = height
        for axis in range(3):
            images[k + 1, axis] = images[k, axis] - 2.0 * height * planes[p, axis]
    total = 0.0
    for axis in range(3):
        leave[axis] = listener[axis] - images[count, axis]
        total += leave[axis] * leave[axis]
    length = max(sqrt(total), 1e-9)
    for axis in range(3):
        leave[axis] /= length
        come[axis] = -leave[axis]
    for k in range(count - 1, -1, -1):
        _mirror(leave, planes[walls[k]])
    return length


@njit(cache=True, fastmath=True)
def _mirror(way, plane):
    along = way[0] * plane[0] + way[1] * plane[1] + way[2] * plane[2]
    for axis in range(3):
        way[axis] -= 2.0 * along * plane[axis]


@njit(cache=True, fastmath=True)
def lay_paths(emitters, listeners, row, order, walls, planes, length, leave, come):
    """Write length and directions of every path.

    Parameters
    ----------
    emitters, listeners : ndarray, shape (rows, 3)
        Ends, metres.
    row, order : ndarray of int, shape (n,)
        Row of each path and its number of reflections.
    walls : ndarray of int, shape (n, K)
        Planes met, from the emitter on.
    planes : ndarray, shape (P, 4)
        Unit normals and offsets.
    length, leave, come : ndarray, shape (n,), (n, 3), (n, 3)
        Filled: metres, unit vectors out of the emitter and out of the listener.
    """
    deepest = walls.shape[1]
    images, heights = np.empty((deepest + 1, 3)), np.empty(deepest + 1)
    for k in range(len(row)):
        length[k] = _laid(
            emitters[row[k]], listeners[row[k]], walls[k], order[k], planes, images,
            heights, leave[k], come[k],
        )  # fmt: skip


@njit(cache=True, fastmath=True)
def render_paths(
    row, order, walls, length, leave, come, turns, hearing, scale, latency, factors,
    emitting, listening, bank, lead, out,
):  # fmt: skip
    """Add the pulses of all paths to the samples of their rows.

    Parameters
    ----------
    row, order, walls, length, leave, come
        As from `lay_paths`.
    turns, hearing : ndarray, shape (rows, 3, 3)
        From the room's frame to each device's own.
    scale, latency : float
        Samples a metre, samples before every arrival.
    factors : ndarray, shape (P,)
        Reflection factors.
    emitting, listening : ndarray, shape (harmonics,)
        Patterns.
    bank, lead : ndarray, shape (moments, taps), and int
        Pulse; see `inverse.paths.bank`.
    out : ndarray, shape (rows, n)
        Added to.
    """
    pulse = np.empty(bank.shape[1])
    first, second = np.empty(len(emitting)), np.empty(len(listening))
    for k in range(len(row)):
        r = row[k]
        at = length[k] * scale + latency
        start = int(np.floor(at))
        if start - lead >= out.shape[1]:
            continue
        gain = 1.0 / max(length[k], NEAREST_M)
        for bounce in range(order[k]):
            gain *= factors[walls[k, bounce]]
        gain *= _towards(turns[r], leave[k], emitting, first)
        gain *= _towards(hearing[r], come[k], listening, second)
        fill_pulse(bank, 2.0 * (at - start) - 1.0, pulse)
        add_pulse(out[r], pulse, start - lead, gain)


@njit(cache=True, fastmath=True)
def _towards(turn, way, pattern, basis):
    return path_gain(turn, way[0], way[1], way[2], pattern, basis)


@njit(cache=True, fastmath=True)
def _plane_slopes(walls, count, planes, images, heights, come, tilts, centers, moved):
    """Write how a length follows two tilts and a shift of each plane met.

    `moved` has shape (K, 3), one line a bounce.
    """
    back = come.copy()
    for k in range(count - 1, -1, -1):
        p = walls[k]
        along = 0.0
        for axis in range(3):
            along += back[axis] * planes[p, axis]
        for tilt in range(2):
            pull, shift = 0.0, 0.0
            for axis in range(3):
                by = tilts[p, tilt, axis]
                pull += by * (along * images[k, axis] + heights[k] * back[axis])
                shift += by * centers[p, axis]
            moved[k, tilt] = 2.0 * (along * shift - pull)
        moved[k, 2] = 2.0 * along
        _mirror(back, planes[p])


@njit(cache=True, fastmath=True)
def accumulate_paths(
    emitters, listeners, starts, order, walls, planes, tilts, centers, turns, hearing,
    scale, latency, factors, emitting, listening, bank, lead, speed, rate, active,
    targets, weights, slow, square, right, misfit,
):  # fmt: skip
    """Add up the normal equations of Gauss-Newton over all rows.

    Parameters are speed of sound, latency in samples, two tilts and a shift of
    each plane, a factor for each plane, and the emitter's pattern.

    Parameters
    ----------
    starts : ndarray of int, shape (rows + 1,)
        Paths of row r: ``starts[r] : starts[r + 1]``.
    tilts, centers : ndarray, shape (P, 2, 3), (P, 3)
        Directions a normal may lean to, and the points about which planes tilt.
    active, targets, weights, slow, square, misfit
        As in `inverse.paths.lattice_kernel.accumulate_rows`.
    right : ndarray, shape (rows, parameters)
        Filled with each row's part of J^T r.
    """
    n, count, taps = targets.shape[1], len(active), bank.shape[1]
    planes_count = len(planes)
    wall_at, pattern_at = 2 + 3 * planes_count, 2 + 4 * planes_count
    deepest = walls.shape[1]
    images, heights = np.empty((deepest + 1, 3)), np.empty(deepest + 1)
    moved = np.empty((deepest + 1, 3))
    leave, come = np.empty(3), np.empty(3)
    pulse, slope = np.empty(taps), np.empty(taps)
    first, second = np.empty(len(emitting)), np.empty(len(listening))
    jacobian, model = np.zeros((count, n)), np.zeros(n)
    square[:] = 0.0
    right[:] = 0.0
    for r in range(len(targets)):
        jacobian[:] = 0.0
        model[:] = 0.0
        for k in range(starts[r], starts[r + 1]):
            length = _laid(
                emitters[r], listeners[r], walls[k], order[k], planes, images,
                heights, leave, come,
            )  # fmt: skip
            at = length * scale + latency
            whole = int(np.floor(at))
            start = whole - lead
            if start >= n or start + taps <= 0:
                continue
            bare = 1.0 / max(length, NEAREST_M)
            for bounce in range(order[k]):
                bare *= factors[walls[k, bounce]]
            bare *= _towards(hearing[r], come, listening, second)
            gain = bare * _towards(turns[r], leave, emitting, first)
            x = 2.0 * (at - whole) - 1.0
            fill_pulse(bank, x, pulse)
            fill_slope(bank, x, slope)
            add_pulse(model, pulse, start, gain)
            if active[0]:
                by_speed = -length * rate / (speed * speed)
                add_pulse(jacobian[0], slope, start, gain * by_speed)
            if active[1]:
                add_pulse(jacobian[1], slope, start, gain)
            _plane_slopes(
                walls[k], order[k], planes, images, heights, come, tilts, centers, moved
            )
            for bounce in range(order[k]):
                p = walls[k, bounce]
                for move in range(3):
                    if active[2 + 3 * p + move]:
                        by = gain * moved[bounce, move] * scale
                        add_pulse(jacobian[2 + 3 * p + move], slope, start, by)
                if active[wall_at + p]:
                    add_pulse(jacobian[wall_at + p], pulse, start, gain / factors[p])
            for j in range(len(emitting)):
                if active[pattern_at + j]:
                    add_pulse(jacobian[pattern_at + j], pulse, start, bare * first[j])
        misfit[r] = add_row(
            targets[r], model, jacobian, weights[r], slow, square, right[r]
        )
