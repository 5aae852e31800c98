"""Compiled ray tracing of energy from one place.

A ray carries one energy per band, in rows of eight. At a hit it loses what is
absorbed; then it goes on either mirrored or in a Lambert direction, never in a mixture
of the two, which keeps the surface as likely one way as the other. All bands share the
way of a ray; `odds` keeps how likely each band would have gone it, against the mean of
all bands.

Rays that follow mirrors only leave nothing to chance: they hand on the share that
is mirrored. The others are scattered by chance, the first time sooner than surfaces
would, at odds that make up for it. They travel in stages, and after each the strong
are divided and the weak drawn from, see `rooms.rays.population`: where one wall
absorbs far more than the others, the few rays that missed it would be all that is left.
"""

import numpy as np
from numba import njit

from rooms.mesh.hits import DEPTH, FEW, first_hit, is_free
from rooms.rays.bounces import draw, patch_at, scattered_way
from rooms.rays.population import resampled
from rooms.rays.rows import WIDTH, add, copy, product, scale

_MIX = np.uint64(0xBF58476D1CE4E5B9)
"""Sets the random numbers of rays apart."""

_EAGER, _EAGER_ORDER = 0.25, 3
"""Chance of the first scattering, if surfaces scatter less, up to this order: longer,
and the few rays that mirrors send on would weigh too much."""

_EVEN = 0.7548776662466927
"""Multiples of it fill 0…1 evenly, whatever those of the golden ratio do."""

_WAITING = 512
"""So many deposits wait and are made at once, which hides how far memory is."""


@njit(cache=True, nogil=True)
def _put_down(flux, waiting, loads, count, wide):
    """Add the rows that wait to a flux whose rows have `wide` bands."""
    many = max(wide // WIDTH, 1)
    for k in range(count):
        if wide < WIDTH:
            for lane in range(wide):
                flux[waiting[k] + lane] += loads[WIDTH * k + lane]
            continue
        for part in range(many):
            add(flux, waiting[k] // WIDTH + part, loads, many * k + part, 1.0)


@njit(cache=True, nogil=True, fastmath={"reassoc", "contract", "nsz"})
def trace(
    tree,
    of_face,
    records,
    bases,
    kept,
    scattered,
    classes,
    start,
    even,
    origin,
    ways,
    scatter,
    balls,
    per_bin,
    skip,
    lift,
    thinning,
    stages,
    weakest,
    key,
    grid,
    flux,
    bins,
    width,
    met,
):
    """Follow rays from a place and return the number of their segments.

    `records` tells where each triangle and its patches are and its row of `kept` and
    `scattered` (surfaces, bands), see `rooms.rays.patches`; where there are `classes`
    of the cosine of incidence, each surface has so many rows, from grazing on. Bands
    fill rows of eight, and `start` is one in those that count. If `even`, all bands are
    scattered alike. Rays follow mirrors only; what they pass on their way, beyond
    `skip` reflections, is added to `grid` (places, bins, bands), and
    what meets a surface to `flux`, flat, which begins for each patch at `bases` and has
    `width` numbers for the bands. Half of the rays end at each of the distances
    `thinning`, and the rest carries on twice the energy. With `scatter` they go
    either way by chance, and only what was scattered before counts, in `flux`; at each
    of the distances `stages[0]` so many rays as `stages[1]` says share the energy. Each
    ray has random numbers of its own, drawn from `key` and its index.
    The triangle, patch and distance that each ray meets first are written to `met`.

    The loop is one piece: handing arrays to functions costs more than the work.
    """
    nodes, children, packs, faces = tree
    x, y, z, radius, volume, whole = balls
    met_face, met_patch, met_length = met
    places, bands = grid.shape[0], grid.shape[2]
    rows = len(start) // WIDTH
    span = max(WIDTH, width)
    meets = len(flux) > 0
    stack, owner = np.empty(DEPTH, dtype=np.int64), np.empty(DEPTH, dtype=np.int64)
    keys = np.empty(16 * DEPTH, dtype=np.int32)
    near, far = np.empty(16, dtype=np.float32), np.empty(8 * FEW)
    chord_square = np.empty(places)
    carried, odds = np.empty(len(start)), np.empty(len(start))
    waiting = np.empty(_WAITING, dtype=np.int64)
    loads, count = np.empty(_WAITING * len(start), dtype=np.float32), 0
    here, there = np.empty(3), np.empty(3)
    handed = kept if scatter else kept * (1.0 - scattered)
    reach = bins / per_bin
    segments = 0
    state, first_pick = draw(key)
    stops, targets = stages
    population = len(ways)
    places_of, marks = np.empty((population, 6)), np.empty((population, 4))
    states = np.empty(population, dtype=np.uint64)
    energies = np.empty((population, len(start)))
    chances = np.empty((population, len(start)))
    for stage in range(len(stops)):
        stop, survivors = stops[stage], 0
        for r in range(population):
            thinned = 0
            if stage == 0:
                state = key + np.uint64(r) * _MIX
                ox, oy, oz = origin[0], origin[1], origin[2]
                wx, wy, wz = ways[r, 0], ways[r, 1], ways[r, 2]
                gone, order, mirrored = 0.0, 0, True
                pick = (first_pick + r * _EVEN) % 1.0
                for part in range(rows):
                    copy(carried, part, start, part)
                    copy(odds, part, start, part)
            else:
                state = states[r]
                ox, oy, oz = places_of[r, 0], places_of[r, 1], places_of[r, 2]
                wx, wy, wz = places_of[r, 3], places_of[r, 4], places_of[r, 5]
                gone, pick = marks[r, 0], marks[r, 1]
                order, mirrored = int(marks[r, 2]), marks[r, 3] > 0.0
                for part in range(rows):
                    copy(carried, part, energies, rows * r + part)
                    copy(odds, part, chances, rows * r + part)
            while True:
                if gone > stop:
                    # survivors are never more than the rays looked at before
                    i, survivors = survivors, survivors + 1
                    states[i] = state
                    places_of[i, 0], places_of[i, 1], places_of[i, 2] = ox, oy, oz
                    places_of[i, 3], places_of[i, 4], places_of[i, 5] = wx, wy, wz
                    marks[i, 0], marks[i, 1] = gone, pick
                    marks[i, 2], marks[i, 3] = order, 1.0 if mirrored else 0.0
                    for part in range(rows):
                        copy(energies, rows * i + part, carried, part)
                        copy(chances, rows * i + part, odds, part)
                    break
                length, face = first_hit(
                    nodes,
                    children,
                    packs,
                    faces,
                    ox,
                    oy,
                    oz,
                    wx,
                    wy,
                    wz,
                    reach - gone,
                    owner,
                    keys,
                    far,
                )
                segments += 1
                if not scatter and order > skip:
                    for i in range(places):
                        mx, my, mz = x[i] - ox, y[i] - oy, z[i] - oz
                        along = mx * wx + my * wy + mz * wz
                        square = mx * mx + my * my + mz * mz
                        chord_square[i] = radius[i] * radius[i] - square + along * along
                    for i in range(places):
                        if chord_square[i] <= 0.0:
                            continue
                        half = np.sqrt(chord_square[i])
                        along = (x[i] - ox) * wx + (y[i] - oy) * wy + (z[i] - oz) * wz
                        enter, end = max(along - half, 0.0), min(along + half, length)
                        middle = (enter + end) / 2
                        at = int((gone + middle) * per_bin)
                        if end <= enter or at >= bins:
                            continue
                        if not whole[i]:
                            here[0], here[1], here[2] = x[i], y[i], z[i]
                            there[0] = ox + middle * wx
                            there[1] = oy + middle * wy
                            there[2] = oz + middle * wz
                            if not is_free(
                                nodes,
                                children,
                                packs,
                                faces,
                                of_face,
                                here,
                                there,
                                -1,
                                -1,
                                lift,
                                stack,
                                near,
                                far,
                            ):
                                continue
                        share = (end - enter) / volume[i]
                        for band in range(bands):
                            grid[i, at, band] += share * carried[band]
                if face < 0:
                    break
                gone += length
                nx, ny, nz = records[face, 0], records[face, 1], records[face, 2]
                inward = nx * wx + ny * wy + nz * wz
                px, py, pz = ox + length * wx, oy + length * wy, oz + length * wz
                if meets and (order == 0 or not (scatter and mirrored)):
                    patch = patch_at(records, face, inward, px, py, pz)
                    at = int(gone * per_bin)
                    if order == 0:
                        met_face[r], met_patch[r], met_length[r] = face, patch, gone
                    if at < bins and not (scatter and mirrored):
                        waiting[count] = bases[patch] + at * span
                        for part in range(rows):
                            copy(loads, rows * count + part, carried, part)
                        count += 1
                        if count == _WAITING:
                            _put_down(flux, waiting, loads, count, width)
                            count = 0
                if inward > 0.0:
                    nx, ny, nz, inward = -nx, -ny, -nz, -inward
                ox, oy, oz = px + lift * nx, py + lift * ny, pz + lift * nz
                row = int(records[face, 3])
                if classes > 1:
                    row = row * classes + min(int(-inward * classes), classes - 1)
                for part in range(rows):
                    scale(carried, part, handed, rows * row + part, 1.0, 0.0)
                order += 1
                if thinned < len(thinning) and gone > thinning[thinned]:
                    if (r >> thinned) & 1:
                        break
                    thinned += 1
                    for part in range(rows):
                        scale(carried, part, start, part, 2.0, 0.0)
                if order % 8 == 0:
                    strongest = 0.0
                    for band in range(bands):
                        strongest = max(strongest, carried[band])
                    if strongest < weakest:
                        break
                if not scatter:
                    wx -= 2.0 * inward * nx
                    wy -= 2.0 * inward * ny
                    wz -= 2.0 * inward * nz
                    continue
                likely = scattered[row, 0]
                if not even:
                    likely, weight = 0.0, 0.0
                    for part in range(rows):
                        likely += product(odds, part, scattered, rows * row + part)
                        weight += product(odds, part, start, part)
                    likely /= weight
                chance = likely
                if mirrored and order <= _EAGER_ORDER and 0.0 < likely < _EAGER:
                    chance = _EAGER
                if mirrored:
                    # one number decides on the order of the first scattering: evenly
                    fresh = pick < chance
                    pick = pick if fresh else (pick - chance) / (1.0 - chance)
                else:
                    state, u = draw(state)
                    fresh = u < chance
                if not even or chance != likely:
                    # scattered / chance, or the rest of both
                    by = 1.0 / chance if fresh else -1.0 / (1.0 - chance)
                    more = 0.0 if fresh else -by
                    for part in range(rows):
                        at = rows * row + part
                        scale(carried, part, scattered, at, by, more)
                        if not even:
                            scale(odds, part, scattered, at, by, more)
                if not fresh:
                    wx -= 2.0 * inward * nx
                    wy -= 2.0 * inward * ny
                    wz -= 2.0 * inward * nz
                    continue
                mirrored = False
                state, wx, wy, wz = scattered_way(state, nx, ny, nz)
        if stage + 1 < len(stops):
            key, u = draw(key)
            travellers = places_of, marks, states, energies, chances
            travellers = resampled(travellers, survivors, targets[stage], u)
            places_of, marks, states, energies, chances = travellers
            population = len(states)
    _put_down(flux, waiting, loads, count, width)
    return segments
