"""Compiled: chains of scattering that keep close, point by point.

A chain goes on from where the rays of a place are scattered first, see
`rooms.transport.single`; each of its ends is joined to the other place. The rays of
that place make the same chain from its other end, and by Lambert's law all steps but
the first are as likely from there. So the shares that both have in what arrives at
their own ends weigh them (balance heuristic), and no place is too close.
"""

import numpy as np
from numba import njit

from rooms.rays.bounces import draw, scattered_way
from rooms.transport.single import CLASSES, density

__all__ = ["LINKS", "follow_chains", "join_chains"]

LINKS = 8
"""Most scatterings of a chain: half of what walls of a corner scatter leaves it each
time."""

_FAINT = 1e-5
"""Share of its energy below which a chain ends (-50 dB)."""

_EVEN = (0.7548776662466927, 0.5698402909980532)
"""Multiples of both fill a square evenly: powers of the root of x³ = x + 1."""


@njit(cache=True, nogil=True, error_model="numpy")
def follow_chains(size, hits, factors, shares, copies, longest, key, ends, energies):
    """Follow what hits scatter; return how many ends of chains there are.

    Parameters
    ----------
    size : ndarray, shape (3,)
        Lengths of the box [m].
    hits : tuple (whole, points, values)
        See `rooms.transport.single.collect_hits`.
    factors : ndarray, shape (6, classes, lanes)
        What a hit scatters.
    shares : tuple of ndarray, shape (6, lanes)
        What walls scatter and mirror of what arrives.
    copies : int
        Chains of each hit.
    longest : float
        Longest way between two scatterings [m].
    key : int
        Random numbers begin with it.
    ends : ndarray, shape (E, 6)
        Gets points [m], ways [m], density at the beginnings, and walls.
    energies : ndarray, shape (E, lanes)
        Gets what arrives.
    """
    whole, points, values = hits
    scattered, mirrored = shares
    lanes = scattered.shape[1]
    at, way, left = np.empty(3), np.empty(3), np.empty(lanes)
    count, state = 0, key
    for h in range(copies * len(whole)):
        hit = h // copies
        wall, strongest = whole[hit, 0], 0.0
        for lane in range(lanes):
            left[lane] = factors[wall, whole[hit, 1], lane] * values[hit, 2] / copies
            strongest = max(strongest, left[lane])
        faint = _FAINT * strongest
        at[:] = points[hit]
        gone, link, links, fresh = values[hit, 0], 0.0, 1, True
        while strongest > faint:
            if fresh:
                axis, ahead = wall // 2, 1.0 - 2.0 * (wall % 2)
                state, u, v, w = scattered_way(state, 0.0, 0.0, 1.0)
                if links == 1:
                    # first ways fill the half sphere evenly over all chains
                    square, turn = (h * _EVEN[0]) % 1.0, (h * _EVEN[1]) % 1.0
                    flat, turn = np.sqrt(square), 2.0 * np.pi * turn
                    u, v, w = flat * np.cos(turn), flat * np.sin(turn), 1.0 - square
                    w = np.sqrt(w)
                way[axis] = max(w, 1e-9) * ahead
                way[(axis + 1) % 3], way[(axis + 2) % 3] = u, v
                link = 0.0
            length, old = 1e30, wall
            for k in range(3):
                until = 1e30
                if way[k] > 0.0 and old != 2 * k + 1:
                    until = max(size[k] - at[k], 0.0) / way[k]
                elif way[k] < 0.0 and old != 2 * k:
                    until = max(at[k], 0.0) / -way[k]
                if until < length:
                    length = until
                    wall = 2 * k + (1 if way[k] > 0.0 else 0)
            link += length
            gone += length
            if link > longest or count == len(ends):
                break
            for k in range(3):
                at[k] = min(max(at[k] + length * way[k], 0.0), size[k])
            axis = wall // 2
            at[axis] = size[axis] * (wall % 2)
            ends[count, :3] = at
            ends[count, 3], ends[count, 4], ends[count, 5] = gone, values[hit, 1], wall
            energies[count] = left
            count += 1
            chance = 0.0
            for lane in range(lanes):
                both = scattered[wall, lane] + mirrored[wall, lane]
                if both > 0.0:
                    chance += scattered[wall, lane] / both / lanes
            state, u = draw(state)
            fresh = u < chance
            links += 1 if fresh else 0
            if links == LINKS:
                break
            strongest = 0.0
            for lane in range(lanes):
                if fresh:
                    left[lane] *= scattered[wall, lane] / chance
                else:
                    left[lane] *= mirrored[wall, lane] / (1.0 - chance)
                strongest = max(strongest, left[lane])
            way[axis] = -way[axis]
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def join_chains(size, chains, place, nearest, mirrors, factors, per_bin, out):
    """Join the ends of chains of one place to another, in sums over time.

    Parameters
    ----------
    size : ndarray, shape (3,)
        Lengths of the box [m].
    chains : tuple (ends, energies)
        See `follow_chains`.
    place, nearest, mirrors : ndarray
        The other place; see `rooms.transport.single.collect_hits`.
    factors : ndarray, shape (6, classes, lanes)
        What of the energy at a wall goes the way of each class.
    per_bin : float
        Time steps per metre.
    out : ndarray, shape (steps, lanes)
        Gets the sums.
    """
    ends, energies = chains
    steps, lanes = out.shape
    parts = np.empty((2, CLASSES))
    for e in range(len(ends)):
        wall = int(ends[e, 5])
        total = density(size, place, nearest, mirrors, wall, ends[e], parts)
        own = ends[e, 4] / (ends[e, 4] + total)
        for k in range(CLASSES):
            step = int((ends[e, 3] + parts[1, k]) * per_bin)
            if parts[0, k] == 0.0 or step >= steps:
                continue
            for lane in range(lanes):
                part = energies[e, lane] * factors[wall, k, lane]
                out[step, lane] += part * parts[0, k] * own
