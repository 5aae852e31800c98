"""Compiled ray tracing of energy from one place to others.

A ray carries one energy per band. At a hit it loses what is absorbed; then it goes
on either mirrored or in a Lambert direction, never in a mixture of the two, which
keeps the surface as likely one way as the other. All bands share the way of a ray;
`odds` keeps how likely each band would have gone it, against the mean of all bands.
"""

import numpy as np
from numba import njit

from rooms.mesh.backtrace import LIST, blocked_by
from rooms.mesh.hits import DEPTH, FEW, first_hit, is_free

_STEP = np.uint64(0x9E3779B97F4A7C15)
_MIX_ONE = np.uint64(0xBF58476D1CE4E5B9)
_MIX_TWO = np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31, _S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)


@njit(cache=True, nogil=True, inline="always")
def draw(state):
    """Return the next state and a number in 0…1.

    G. Steele, D. Lea, C. Flood, OOPSLA 2014: SplitMix.
    """
    state = state + _STEP
    z = (state ^ (state >> _S30)) * _MIX_ONE
    z = (z ^ (z >> _S27)) * _MIX_TWO
    z = z ^ (z >> _S31)
    return state, (z >> _S11) * (1.0 / 9007199254740992.0)


@njit(cache=True, nogil=True, fastmath={"reassoc", "contract", "nsz"})
def trace(
    tree,
    of_face,
    blockers,
    rims,
    planes,
    surface,
    kept,
    scattered,
    origin,
    ways,
    balls,
    per_bin,
    skip,
    lift,
    nearest,
    weakest,
    key,
    grid,
):
    """Follow rays from a place; add to `grid` (places, bins, bands); count segments.

    `surface` (F,) names the row of `kept` and `scattered` (surfaces, bands) of each
    triangle. Mirror paths of at most `skip` reflections are not counted. Each ray
    has random numbers of its own, drawn from `key` and its index.

    The loop is one piece: handing arrays to functions costs more than the work.
    """
    nodes, children, packs, faces = tree
    x, y, z, radius, volume, whole = balls
    places, bins, bands = grid.shape
    stack, depth = np.empty(DEPTH, dtype=np.int64), np.empty(DEPTH)
    near, far = np.empty(16, dtype=np.float32), np.empty(8 * FEW)
    chord_square = np.empty(places)
    energy, odds, carried = np.empty(bands), np.empty(bands), np.empty(bands)
    here, there = np.empty(3), np.empty(3)
    few = len(blockers) <= LIST
    even = True
    for row in range(len(scattered)):
        for band in range(bands):
            even &= scattered[row, band] == scattered[row, 0]
    reach = bins / per_bin
    segments = 0
    for r in range(len(ways)):
        state = key + np.uint64(r) * _MIX_ONE
        ox, oy, oz = origin[0], origin[1], origin[2]
        wx, wy, wz = ways[r, 0], ways[r, 1], ways[r, 2]
        gone, order, mirrored, fresh = 0.0, 0, True, False
        for band in range(bands):
            energy[band], odds[band], carried[band] = 1.0, 1.0, 1.0
        while True:
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
                stack,
                depth,
                near,
                far,
            )
            segments += 1
            # what a surface scatters has reached the places as rain already
            if not fresh and not (mirrored and order <= skip):
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
                    first, last = max(along - half, 0.0), min(along + half, length)
                    middle = (first + last) / 2
                    at = int((gone + middle) * per_bin)
                    if last <= first or at >= bins:
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
                    share = (last - first) / volume[i]
                    for band in range(bands):
                        grid[i, at, band] += share * carried[band]
            if face < 0:
                break
            gone += length
            nx, ny, nz = planes[face, 0], planes[face, 1], planes[face, 2]
            inward = nx * wx + ny * wy + nz * wz
            if inward > 0.0:
                nx, ny, nz, inward = -nx, -ny, -nz, -inward
            ox = ox + length * wx + lift * nx
            oy = oy + length * wy + lift * ny
            oz = oz + length * wz + lift * nz
            row = surface[face]
            for band in range(bands):
                energy[band] *= kept[row, band]
            order += 1
            if order % 8 == 0:
                strongest = 0.0
                for band in range(bands):
                    strongest = max(strongest, energy[band] * odds[band])
                if strongest < weakest:
                    break
            likely = scattered[row, 0]
            if not even:
                likely = 0.0
                for band in range(bands):
                    likely += scattered[row, band] * odds[band]
                likely /= bands
            state, u = draw(state)
            fresh = u < likely
            if not even:
                for band in range(bands):
                    share = scattered[row, band]
                    share = share / likely if fresh else (1.0 - share) / (1.0 - likely)
                    odds[band] *= share
            for band in range(bands):
                carried[band] = energy[band] * odds[band]
            if not fresh:
                wx -= 2.0 * inward * nx
                wy -= 2.0 * inward * ny
                wz -= 2.0 * inward * nz
                continue
            mirrored = False
            panel = of_face[face]
            for i in range(places):
                vx, vy, vz = x[i] - ox, y[i] - oy, z[i] - oz
                height = vx * nx + vy * ny + vz * nz
                square = vx * vx + vy * vy + vz * vz
                away = np.sqrt(square)
                at = int((gone + away) * per_bin)
                if height <= 0.0 or at >= bins:
                    continue
                if few:
                    if blocked_by(
                        ox,
                        oy,
                        oz,
                        x[i],
                        y[i],
                        z[i],
                        panel,
                        -1,
                        blockers,
                        of_face,
                        rims,
                        planes,
                        lift,
                    ):
                        continue
                else:
                    here[0], here[1], here[2] = ox, oy, oz
                    there[0], there[1], there[2] = x[i], y[i], z[i]
                    if not is_free(
                        nodes,
                        children,
                        packs,
                        faces,
                        of_face,
                        here,
                        there,
                        panel,
                        -1,
                        lift,
                        stack,
                        near,
                        far,
                    ):
                        continue
                # Lambert: energy cos / (pi r²) per area
                share = height / away / (np.pi * max(square, nearest))
                for band in range(bands):
                    grid[i, at, band] += share * carried[band]
            state, u = draw(state)
            state, v = draw(state)
            # a point on the unit sphere around the normal's tip: Lambert's law
            up, turn = 2.0 * u - 1.0, 2.0 * np.pi * v
            flat = np.sqrt(max(1.0 - up * up, 0.0))
            wx = nx + flat * np.cos(turn)
            wy = ny + flat * np.sin(turn)
            wz = nz + up
            size = np.sqrt(wx * wx + wy * wy + wz * wz)
            if size < 1e-9:
                wx, wy, wz, size = nx, ny, nz, 1.0
            wx, wy, wz = wx / size, wy / size, wz / size
    return segments
