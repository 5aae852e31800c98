"""Compiled: chains of scattering between surfaces that two places are close to.

A chain begins at the point that a ray of a place scatters at first, straight from the
place or mirrored by surfaces close to it, and ends wherever it has come. Its end is
joined to the other place, straight or as that place's images in surfaces close to it
see it. The rays of the other place make the same chain from its other end, and by
Lambert's law both are as likely but for the first step. So with the distances d and
the cosines c at both ends, a chain stands for 4 of its energy / (d² / c + d'² / c')
over the number of rays (balance heuristic): there is no pole, however close places
are.

E. Veach, PhD thesis, Stanford University, 1997, chapter 9.
"""

import numpy as np
from numba import njit

from rooms.mesh.hits import DEPTH, FEW, first_hit
from rooms.rays.bounces import CLOSEST, draw, patch_at, scattered_way

__all__ = ["blur_chains", "follow_chains", "join_chains"]

_LINKS = 16
"""Most surfaces of a chain: half of what walls of a corner scatter leaves it."""


@njit(cache=True, nogil=True)
def _longer(table):
    """Return a table with room for twice as many rows."""
    more = np.empty((2 * table.shape[0], table.shape[1]), dtype=table.dtype)
    more[: len(table)] = table
    return more


@njit(cache=True, nogil=True)
def follow_chains(room, shares, origin, ways, near, after, longest, reach, lift, key):
    """Follow the rays of a place and what they scatter while it stays close.

    Parameters
    ----------
    room : tuple
        Tree, panels of faces, and records of faces as `trace` takes them.
    shares : tuple of ndarray, shape (surfaces, classes, bands)
        What is kept and what of it is scattered, by classes of the cosine.
    origin, ways : ndarray, shape (3,), (batches, rays, 3)
        The place [m] and its rays.
    near, after : ndarray of int, shape (N,), (images, N)
        Panels close to it, and the image of each image in each of these, -1 for none.
    longest, reach, lift : float
        Longest chain and way [m], and distance from surfaces that rays start at [m].
    key : int
        Random numbers begin with it.

    Returns
    -------
    points, marks, whole, energies : ndarray, shape (E, 3), (E, 3), (E, 5), (E, bands)
        Ends of chains; ways [m], d² / c of the beginnings [m²], and cosines; faces,
        patches, batches, images, and which side of a face is met (1 or -1), twice that
        if the chain is longer than its first point; what arrives.
    """
    tree, of_face, records = room
    nodes, children, packs, faces = tree
    kept, scattered = shares
    classes, bands = kept.shape[1], kept.shape[2]
    owner = np.empty(DEPTH, dtype=np.int64)
    keys, far = np.empty(16 * DEPTH, dtype=np.int32), np.empty(8 * FEW)
    points, marks = np.empty((1024, 3)), np.empty((1024, 3))
    whole = np.empty((1024, 5), dtype=np.int64)
    energies = np.empty((1024, bands))
    carried, left = np.empty(bands), np.empty(bands)
    count, state = 0, key
    for batch in range(ways.shape[0]):
        for r in range(ways.shape[1]):
            ox, oy, oz = origin[0], origin[1], origin[2]
            wx, wy, wz = ways[batch, r, 0], ways[batch, r, 1], ways[batch, r, 2]
            gone, image, link, chain, weight = 0.0, 0, 0, 0.0, 0.0
            sx, sy, sz, mirrors_on = 0.0, 0.0, 0.0, True
            mx, my, mz, ahead, behind = 0.0, 0.0, 0.0, 0.0, 0
            left[:] = 1.0
            carried[:] = 1.0
            while True:
                # link 0 is mirrored only; from each of its points a chain goes out
                length, face = first_hit(
                    nodes, children, packs, faces, ox, oy, oz, wx, wy, wz,
                    reach - gone - chain, owner, keys, far,
                )  # fmt: skip
                if link > 0 and face >= 0:
                    chain += length
                if face < 0 or (link > 0 and (chain > longest or link >= _LINKS)):
                    if link == 0 or not mirrors_on:
                        break
                    # the chain is over: go on by mirrors from where it began
                    link, chain, image = 0, 0.0, behind
                    ox, oy, oz, wx, wy, wz = sx, sy, sz, mx, my, mz
                    gone = ahead
                    carried[:] = left
                    continue
                if link == 0:
                    gone += length
                nx, ny, nz = records[face, 0], records[face, 1], records[face, 2]
                inward = nx * wx + ny * wy + nz * wz
                px, py, pz = ox + length * wx, oy + length * wy, oz + length * wz
                side = -1 if inward > 0.0 else 1
                patch = patch_at(records, face, inward, px, py, pz)
                nx, ny, nz, inward = side * nx, side * ny, side * nz, -abs(inward)
                if link == 0:
                    weight = max(gone * gone / max(-inward, 1e-12), CLOSEST)
                if count == len(points):
                    points, marks = _longer(points), _longer(marks)
                    whole, energies = _longer(whole), _longer(energies)
                points[count, 0], points[count, 1], points[count, 2] = px, py, pz
                marks[count, 0], marks[count, 1] = gone + chain, weight
                marks[count, 2] = -inward
                whole[count, 0], whole[count, 1] = face, patch
                whole[count, 2], whole[count, 3] = batch, image
                whole[count, 4] = side if link == 0 else 2 * side
                energies[count] = carried
                count += 1
                row = int(records[face, 3])
                k = min(int(-inward * classes), classes - 1)
                ox, oy, oz = px + lift * nx, py + lift * ny, pz + lift * nz
                tx, ty, tz = (
                    wx - 2.0 * inward * nx,
                    wy - 2.0 * inward * ny,
                    wz - 2.0 * inward * nz,
                )
                fresh, chance = True, 1.0
                if link == 0:
                    mirrors_on, strongest = False, 0.0
                    for j in range(len(near)):
                        if near[j] == of_face[face] and after[image, j] >= 0:
                            mirrors_on, behind = True, after[image, j]
                    if mirrors_on:
                        sx, sy, sz, mx, my, mz, ahead = ox, oy, oz, tx, ty, tz, gone
                        for band in range(bands):
                            part = kept[row, k, band] * (1.0 - scattered[row, k, band])
                            left[band] = carried[band] * part
                            strongest = max(strongest, left[band])
                        mirrors_on = strongest > 0.0
                else:
                    chance = 0.0
                    for band in range(bands):
                        chance += scattered[row, k, band] / bands
                    state, u = draw(state)
                    fresh = u < chance
                strongest = 0.0
                for band in range(bands):
                    part = scattered[row, k, band]
                    part = part / chance if fresh else (1.0 - part) / (1.0 - chance)
                    carried[band] *= kept[row, k, band] * part
                    strongest = max(strongest, carried[band])
                wx, wy, wz = tx, ty, tz
                if fresh:
                    state, wx, wy, wz = scattered_way(state, nx, ny, nz)
                link += 1
                if strongest <= 0.0:
                    # nothing goes out here: the next look ends the chain
                    link = _LINKS
    return points[:count], marks[:count], whole[:count], energies[:count]


@njit(cache=True, nogil=True)
def join_chains(room, tables, chains, images, walls, per_bin, each, slack, lift, rows):
    """Join chains to the images of the other place; add to (batches, bins, bands).

    Single points that both places see straight are left out, see `rooms.rays.first`.

    Parameters
    ----------
    room, chains, lift
        See `follow_chains`.
    tables : tuple of ndarray, shape (surfaces, classes, bands)
        Shares of what arrives that are scattered and mirrored.
    images, walls : ndarray, shape (images, 3), (images, 2)
        The place and its images [m], and the panels that mirror, -1 for none, in order
        from the place.
    per_bin, each, slack : float
        Time steps per metre, rays of a batch, and how close to its end a way counts as
        free [m].
    """
    tree, of_face, records = room
    nodes, children, packs, faces = tree
    share, mirrored = tables
    points, marks, whole, energies = chains
    _, bins, bands = rows.shape
    classes = share.shape[1]
    owner, factor = np.empty(DEPTH, dtype=np.int64), np.empty(bands)
    keys, far = np.empty(16 * DEPTH, dtype=np.int32), np.empty(8 * FEW)
    for e in range(len(points)):
        start, batch = whole[e, 0], whole[e, 2]
        single, side = abs(whole[e, 4]) == 1, 1.0 if whole[e, 4] > 0 else -1.0
        row = int(records[start, 3])
        one = min(int(marks[e, 2] * classes), classes - 1)
        for m in range(len(images)):
            if single and whole[e, 3] == 0 and m == 0:
                continue
            face = start
            nx, ny, nz = (
                side * records[face, 0],
                side * records[face, 1],
                side * records[face, 2],
            )
            wx = images[m, 0] - points[e, 0]
            wy = images[m, 1] - points[e, 1]
            wz = images[m, 2] - points[e, 2]
            square = wx * wx + wy * wy + wz * wz
            span = np.sqrt(square)
            step = int((marks[e, 0] + span) * per_bin)
            steep = nx * wx + ny * wy + nz * wz
            if steep <= 0.0 or step >= bins:
                continue
            steep /= span
            wx, wy, wz = wx / span, wy / span, wz / span
            ox = points[e, 0] + lift * nx
            oy = points[e, 1] + lift * ny
            oz = points[e, 2] + lift * nz
            factor[:] = 1.0
            free, ahead = True, span
            for k in range(1, -1, -1):
                if walls[m, k] < 0:
                    continue
                length, face = first_hit(
                    nodes, children, packs, faces, ox, oy, oz, wx, wy, wz, ahead,
                    owner, keys, far,
                )  # fmt: skip
                if face < 0 or of_face[face] != walls[m, k]:
                    free = False
                    break
                nx, ny, nz = records[face, 0], records[face, 1], records[face, 2]
                inward = nx * wx + ny * wy + nz * wz
                if inward > 0.0:
                    nx, ny, nz, inward = -nx, -ny, -nz, -inward
                by = min(int(-inward * classes), classes - 1)
                for band in range(bands):
                    factor[band] *= mirrored[int(records[face, 3]), by, band]
                ox += length * wx + lift * nx
                oy += length * wy + lift * ny
                oz += length * wz + lift * nz
                wx -= 2.0 * inward * nx
                wy -= 2.0 * inward * ny
                wz -= 2.0 * inward * nz
                ahead -= length
            if not free:
                continue
            if ahead > slack:
                _, face = first_hit(
                    nodes, children, packs, faces, ox, oy, oz, wx, wy, wz,
                    ahead - slack, owner, keys, far,
                )  # fmt: skip
                if face >= 0:
                    continue
            weight = (marks[e, 1] + max(square / steep, CLOSEST)) * each
            two = min(int(steep * classes), classes - 1)
            for band in range(bands):
                both = share[row, one, band] + share[row, two, band]
                both *= energies[e, band] * factor[band]
                rows[batch, step, band] += 2.0 * both / weight


@njit(cache=True, nogil=True)
def _poured(order, chains, i, per_bin, sums):
    """Add what meets a patch to sums (2, batches + 1, bins, bands) over time.

    The first are single points, the second longer chains; the last batch is all.
    Return where the next patch begins and the range of time steps.
    """
    _, marks, whole, energies = chains
    last, bins = sums.shape[1] - 1, sums.shape[2]
    patch, low, high = whole[order[i], 1], bins, 0
    while i < len(order) and whole[order[i], 1] == patch:
        e = order[i]
        t = int(marks[e, 0] * per_bin)
        i += 1
        if t >= bins:
            continue
        kind = abs(whole[e, 4]) - 1
        for band in range(sums.shape[3]):
            sums[kind, whole[e, 2], t, band] += energies[e, band]
            sums[kind, last, t, band] += energies[e, band]
        low, high = min(low, t), max(high, t + 1)
    return i, min(low, high), high


@njit(cache=True, nogil=True)
def blur_chains(orders, here, there, share, per_bin, rows):
    """Add what patches make of all chains to rows (batches, bins, bands).

    Parameters
    ----------
    orders : tuple of ndarray
        Chains of either place, patch by patch.
    here, there : tuple
        Chains, see `follow_chains`.
    share : ndarray, shape (patches, bands)
        What patches hand on.
    """
    batches, bins, bands = rows.shape
    one = np.zeros((2, batches + 1, bins, bands))
    two = np.zeros((2, batches + 1, bins, bands))
    i = j = 0
    while i < len(orders[0]) and j < len(orders[1]):
        p, q = here[2][orders[0][i], 1], there[2][orders[1][j], 1]
        if p < q:
            i += 1
            continue
        if q < p:
            j += 1
            continue
        i, low, high = _poured(orders[0], here, i, per_bin, one)
        j, start, end = _poured(orders[1], there, j, per_bin, two)
        for t in range(low, high):
            for u in range(start, min(end, bins - t)):
                for k in range(batches):
                    for band in range(bands):
                        # mirrored only counts whole, scattered from either end half
                        first = one[0, k, t, band] + 0.5 * one[1, k, t, band]
                        more = first * two[0, batches, u, band]
                        more += 0.5 * one[0, k, t, band] * two[1, batches, u, band]
                        first = two[0, k, u, band] + 0.5 * two[1, k, u, band]
                        more += first * one[0, batches, t, band]
                        more += 0.5 * two[0, k, u, band] * one[1, batches, t, band]
                        rows[k, t + u, band] += share[p, band] * more
        one[:, :, low:high] = 0.0
        two[:, :, start:end] = 0.0
