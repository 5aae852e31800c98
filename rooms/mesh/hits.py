"""Compiled search of what a ray meets."""

import numpy as np
from numba import njit

from rooms.mesh.lanes import (
    boxes_hit,
    key_of,
    lowest_bit,
    nearest_box,
    next_box,
    triangles_hit,
)

DEPTH = 256  # boxes that wait: 15 of each of 17 levels, of trees 16 wide
FEW = 4
"""So many packs are tried one by one faster than by way of the tree."""
_STEEP = 1e-18  # its inverse is finite in single precision


@njit(cache=True, nogil=True, inline="always")
def steady(x):
    """Keep a component of a direction away from zero."""
    if abs(x) < _STEEP:
        return _STEEP if x >= 0.0 else -_STEEP
    return x


@njit(cache=True, nogil=True, inline="always")
def first_hit(
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
    limit,
    owner,
    keys,
    far,
):
    """Return (distance, triangle) of the nearest hit before `limit`, or -1.

    `owner` (DEPTH), `keys` (DEPTH * 16), int32, and `far` (32) are working space.
    Arrays come one by one: unpacking a tuple here would cost more than the search.
    """
    best, face = limit, np.int64(-1)
    if limit <= 0.0:
        return best, face
    if len(packs) <= FEW:
        mask = np.int64(0)
        for pack in range(len(packs)):
            met = triangles_hit(
                packs, pack, ox, oy, oz, wx, wy, wz, limit, far, np.int64(pack)
            )
            mask |= met << (8 * pack)
        while mask:
            lane = lowest_bit(mask)
            mask &= mask - 1
            if far[lane] < best:
                best, face = far[lane], lane
        face = faces[face >> 3, face & 7] if face >= 0 else face
        return best, face
    ix, iy, iz = 1.0 / steady(wx), 1.0 / steady(wy), 1.0 / steady(wz)
    signs = np.int64(ix < 0.0) + 2 * np.int64(iy < 0.0) + 4 * np.int64(iz < 0.0)
    ax, ay, az = -ox * ix, -oy * iy, -oz * iz
    top, owner[0] = 0, 0
    key = nearest_box(nodes, 0, signs, ix, iy, iz, ax, ay, az, best, keys, 0)
    enough = key_of(best)
    while True:
        if key >= enough:
            if top == 0:
                return best, face
            top -= 1
            key = next_box(keys, top)
            continue
        node = children[owner[top], key & 15]
        if node >= 0:
            top += 1
            owner[top] = node
            key = nearest_box(
                nodes, node, signs, ix, iy, iz, ax, ay, az, best, keys, top
            )
            continue
        mask = triangles_hit(packs, -1 - node, ox, oy, oz, wx, wy, wz, best, far, 0)
        while mask:
            lane = lowest_bit(mask)
            mask &= mask - 1
            if far[lane] < best:
                best, face = far[lane], faces[-1 - node, lane]
                enough = key_of(best)
        key = next_box(keys, top)


@njit(cache=True, nogil=True)
def is_free(
    nodes,
    children,
    packs,
    faces,
    of_face,
    a,
    b,
    skip_one,
    skip_other,
    slack,
    stack,
    near,
    far,
):
    """Tell whether nothing but two panels meets the segment between two points."""
    wx, wy, wz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    span = np.sqrt(wx * wx + wy * wy + wz * wz)
    if span <= 2.0 * slack:
        return True
    end = slack / span
    ix, iy, iz = 1.0 / steady(wx), 1.0 / steady(wy), 1.0 / steady(wz)
    signs = np.int64(ix < 0.0) + 2 * np.int64(iy < 0.0) + 4 * np.int64(iz < 0.0)
    ax, ay, az = -a[0] * ix, -a[1] * iy, -a[2] * iz
    node, top = np.int64(0), 0
    while True:
        if node >= 0:
            mask = boxes_hit(nodes, node, signs, ix, iy, iz, ax, ay, az, 1.0, near)
            while mask:
                lane = lowest_bit(mask)
                mask &= mask - 1
                stack[top] = children[node, lane]
                top += 1
        else:
            pack = -1 - node
            mask = triangles_hit(
                packs, pack, a[0], a[1], a[2], wx, wy, wz, 1.0 - end, far, 0
            )
            while mask:
                lane = lowest_bit(mask)
                mask &= mask - 1
                panel = of_face[faces[pack, lane]]
                if far[lane] > end and panel not in (skip_one, skip_other):
                    return False
        if top == 0:
            return True
        top -= 1
        node = stack[top]


@njit(cache=True, nogil=True)
def free_ways(tree, of_face, starts, ends, slack):
    """Tell which segments between points, shape (N, 3), are free."""
    nodes, children, packs, faces = tree
    stack, near = np.empty(DEPTH, dtype=np.int64), np.empty(16, dtype=np.float32)
    far = np.empty(8 * FEW)
    free = np.empty(len(starts), dtype=np.bool_)
    for i in range(len(starts)):
        free[i] = is_free(
            nodes,
            children,
            packs,
            faces,
            of_face,
            starts[i],
            ends[i],
            -1,
            -1,
            slack,
            stack,
            near,
            far,
        )
    return free
