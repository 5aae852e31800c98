"""Compiled search for mirror sequences: a tree of image sources clipped by beams.

A node is a sequence of panels. Its beam is the cone from the image through the part
of the last panel that the beams before it reach. The search keeps too much rather
than too little, by `slack`; `rooms.mesh.backtrace` decides exactly.
"""

import numpy as np
from numba import njit

CORNERS = 48
"""Most corners of a clipped panel; beyond it panels stay unclipped."""


@njit(cache=True, nogil=True)
def clip(polygon, count, nx, ny, nz, offset, slack, out):
    """Cut a convex polygon by n·x >= offset - slack; return the corners left.

    J. Sutherland, G. Hodgman, Comm. ACM 17, 32 (1974). -1 says `out` is too small.
    """
    kept = 0
    px, py, pz = polygon[count - 1, 0], polygon[count - 1, 1], polygon[count - 1, 2]
    before = nx * px + ny * py + nz * pz - offset + slack
    for i in range(count):
        qx, qy, qz = polygon[i, 0], polygon[i, 1], polygon[i, 2]
        here = nx * qx + ny * qy + nz * qz - offset + slack
        if (before < 0.0) != (here < 0.0):
            if kept >= CORNERS:
                return -1
            part = before / (before - here)
            out[kept, 0] = px + part * (qx - px)
            out[kept, 1] = py + part * (qy - py)
            out[kept, 2] = pz + part * (qz - pz)
            kept += 1
        if here >= 0.0:
            if kept >= CORNERS:
                return -1
            out[kept, 0], out[kept, 1], out[kept, 2] = qx, qy, qz
            kept += 1
        px, py, pz, before = qx, qy, qz, here
    return kept


@njit(cache=True, nogil=True, inline="always")
def to_middle(image, polygon, count):
    """Return the way from an image to the mean of a polygon's corners."""
    mx, my, mz = 0.0, 0.0, 0.0
    for i in range(count):
        mx += polygon[i, 0]
        my += polygon[i, 1]
        mz += polygon[i, 2]
    return mx / count - image[0], my / count - image[1], mz / count - image[2]


@njit(cache=True, nogil=True)
def bound(image, polygon, count, plane, planes):
    """Write the half-spaces of the beam from an image through a polygon.

    The first is the panel's own plane, whose far side is where the sound goes on.
    """
    mx, my, mz = to_middle(image, polygon, count)
    planes[0] = plane
    used = 1
    ax = polygon[count - 1, 0] - image[0]
    ay = polygon[count - 1, 1] - image[1]
    az = polygon[count - 1, 2] - image[2]
    for i in range(count):
        bx = polygon[i, 0] - image[0]
        by = polygon[i, 1] - image[1]
        bz = polygon[i, 2] - image[2]
        nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        size = np.sqrt(nx * nx + ny * ny + nz * nz)
        far = bx * bx + by * by + bz * bz
        ax, ay, az = bx, by, bz
        # an edge too short to have a direction bounds nothing
        if size > 1e-7 * far:
            if nx * mx + ny * my + nz * mz < 0.0:
                size = -size
            nx, ny, nz = nx / size, ny / size, nz / size
            planes[used, 0], planes[used, 1], planes[used, 2] = nx, ny, nz
            planes[used, 3] = nx * image[0] + ny * image[1] + nz * image[2]
            used += 1
    return used


@njit(cache=True, nogil=True)
def nearest_square(image, polygon, count):
    """Return a lower bound of the squared distance from an image to a polygon."""
    mx, my, mz = to_middle(image, polygon, count)
    size = np.sqrt(mx * mx + my * my + mz * mz)
    if size == 0.0:
        return 0.0
    # all points of the polygon lie beyond its nearest corner along this direction
    least = np.inf
    for i in range(count):
        along = (
            (polygon[i, 0] - image[0]) * mx
            + (polygon[i, 1] - image[1]) * my
            + (polygon[i, 2] - image[2]) * mz
        ) / size
        least = min(least, along)
    return least * least if least > 0.0 else 0.0


@njit(cache=True, nogil=True)
def mark(planes, used, x, y, z, margin):
    """Find the least height of each point over the bounds of a beam."""
    a, b, c, d = planes[0]
    for i in range(len(x)):
        margin[i] = a * x[i] + b * y[i] + c * z[i] - d
    for k in range(1, used):
        a, b, c, d = planes[k, 0], planes[k, 1], planes[k, 2], planes[k, 3]
        for i in range(len(x)):
            height = a * x[i] + b * y[i] + c * z[i] - d
            margin[i] = height if height < margin[i] else margin[i]


@njit(cache=True, nogil=True)
def search(
    emitter,
    listeners,
    normal,
    offset,
    sided,
    hull_start,
    hull,
    center,
    radius,
    max_order,
    max_length,
    max_nodes,
    slack,
):
    """Return (listener, order, sequence, nodes): all sequences that may hold a path.

    `listeners` has shape (3, L). `nodes` is -1 if there were more than `max_nodes`.
    """
    count = listeners.shape[1]
    panels = len(offset)
    room = 1024
    who = np.empty(room, dtype=np.int64)
    orders = np.empty(room, dtype=np.int64)
    sequences = np.full((room, max_order), -1, dtype=np.int32)
    found, nodes = 0, 0
    images = np.empty((max_order + 1, 3))
    planes = np.empty((max_order + 1, CORNERS + 1, 4))
    used = np.zeros(max_order + 1, dtype=np.int64)
    trying = np.zeros(max_order + 1, dtype=np.int64)
    chosen = np.full(max_order + 1, -1, dtype=np.int64)
    margin = np.empty(count)
    polygon, other = np.empty((CORNERS, 3)), np.empty((CORNERS, 3))
    plane = np.empty(4)
    x, y, z = listeners[0], listeners[1], listeners[2]
    reach = max_length * max_length
    images[0] = emitter
    depth = 0
    while depth >= 0:
        p = trying[depth]
        if p == panels or depth == max_order:
            depth -= 1
            continue
        trying[depth] += 1
        if p == chosen[depth]:
            continue
        image = images[depth]
        ix, iy, iz = image[0], image[1], image[2]
        nx, ny, nz = normal[p, 0], normal[p, 1], normal[p, 2]
        height = nx * ix + ny * iy + nz * iz - offset[p]
        if height <= 0.0 and (sided[p] or height == 0.0):
            continue
        missed = False
        for k in range(used[depth]):
            a, b, c, d = (
                planes[depth, k, 0],
                planes[depth, k, 1],
                planes[depth, k, 2],
                planes[depth, k, 3],
            )
            over = a * center[p, 0] + b * center[p, 1] + c * center[p, 2] - d
            if over < -radius[p] - slack:
                missed = True
                break
        if missed:
            continue
        start = hull_start[p]
        corners = hull_start[p + 1] - start
        if corners <= CORNERS:
            for i in range(corners):
                for axis in range(3):
                    polygon[i, axis] = hull[start + i, axis]
            for k in range(used[depth]):
                left = clip(
                    polygon,
                    corners,
                    planes[depth, k, 0],
                    planes[depth, k, 1],
                    planes[depth, k, 2],
                    planes[depth, k, 3],
                    slack,
                    other,
                )
                if left < 0:
                    continue
                corners = left
                polygon, other = other, polygon
                if corners < 3:
                    break
            if corners < 3 or nearest_square(image, polygon, corners) > reach:
                continue
        nodes += 1
        if nodes > max_nodes:
            return who[:found], orders[:found], sequences[:found], -1
        depth += 1
        chosen[depth] = p
        trying[depth] = 0
        mirrored = images[depth]
        mirrored[0] = ix - 2.0 * height * nx
        mirrored[1] = iy - 2.0 * height * ny
        mirrored[2] = iz - 2.0 * height * nz
        side = 1.0 if height > 0.0 else -1.0
        plane[0], plane[1], plane[2] = side * nx, side * ny, side * nz
        plane[3] = side * offset[p]
        if corners <= CORNERS:
            used[depth] = bound(mirrored, polygon, corners, plane, planes[depth])
        else:
            planes[depth, 0], used[depth] = plane, 1
        mark(planes[depth], used[depth], x, y, z, margin)
        for i in range(count):
            if margin[i] < -slack:
                continue
            dx, dy, dz = x[i] - mirrored[0], y[i] - mirrored[1], z[i] - mirrored[2]
            if dx * dx + dy * dy + dz * dz > reach:
                continue
            if found == room:
                room *= 2
                more_who = np.empty(room, dtype=np.int64)
                more_orders = np.empty(room, dtype=np.int64)
                more = np.full((room, max_order), -1, dtype=np.int32)
                more_who[:found], more_orders[:found] = who, orders
                more[:found] = sequences
                who, orders, sequences = more_who, more_orders, more
            who[found], orders[found] = i, depth
            for k in range(depth):
                sequences[found, k] = chosen[k + 1]
            found += 1
    return who[:found], orders[:found], sequences[:found], nodes
