"""Compiled exact check of mirror sequences, in double precision.

Each pair is followed from the same end whichever emits, so that exchanging the ends
gives the same paths to the last bit.
"""

import numpy as np
from numba import njit

from rooms.mesh.hits import DEPTH, FEW, is_free

LIST = 12
"""So many triangles are tried one by one faster than by way of the tree."""


@njit(cache=True, nogil=True)
def precedes(a, b):
    """Tell whether point a comes before b in lexicographic order."""
    for axis in range(3):
        if a[axis] != b[axis]:
            return a[axis] < b[axis]
    return False


@njit(cache=True, nogil=True)
def face_at(points, k, first, last, faces, rims, slack):
    """Return the triangle of a panel that holds point k of its plane, or -1."""
    x, y, z = points[k, 0], points[k, 1], points[k, 2]
    for i in range(first, last):
        face = faces[i]
        inside = True
        for side in range(3):
            height = (
                rims[face, side, 0] * x
                + rims[face, side, 1] * y
                + rims[face, side, 2] * z
                - rims[face, side, 3]
            )
            if height < -slack:
                inside = False
                break
        if inside:
            return face
    return -1


@njit(cache=True, nogil=True)
def blocked_by(points, k, skip_one, skip_other, blocking, rims, slack):
    """Tell whether a triangle of the list stands between point k and the next.

    Panels on which the segment ends are left out.
    """
    blockers, of_face, planes = blocking
    ax, ay, az = points[k, 0], points[k, 1], points[k, 2]
    bx, by, bz = points[k + 1, 0], points[k + 1, 1], points[k + 1, 2]
    dx, dy, dz = bx - ax, by - ay, bz - az
    span = np.sqrt(dx * dx + dy * dy + dz * dz)
    if span <= 2.0 * slack:
        return False
    end = slack / span
    for face in blockers:
        nx, ny, nz = planes[face, 0], planes[face, 1], planes[face, 2]
        above = nx * ax + ny * ay + nz * az - planes[face, 3]
        beyond = nx * bx + ny * by + nz * bz - planes[face, 3]
        if (above > 0.0) == (beyond > 0.0):
            continue
        panel = of_face[face]
        if panel in (skip_one, skip_other):
            continue
        part = above / (above - beyond)
        if part <= end or part >= 1.0 - end:
            continue
        x, y, z = ax + part * dx, ay + part * dy, az + part * dz
        outside = False
        for side in range(3):
            height = (
                rims[face, side, 0] * x
                + rims[face, side, 1] * y
                + rims[face, side, 2] * z
                - rims[face, side, 3]
            )
            outside |= height < -slack
        if not outside:
            return True
    return False


@njit(cache=True, nogil=True)
def follow(sequences, row, order, backwards, panels, slack, images, hits, faces):
    """Write the reflection points of one sequence; tell whether they all exist.

    The ends stand in ``hits[0]`` and ``hits[order + 1]``.
    """
    normal, offset, face_start, members, rims = panels
    for axis in range(3):
        images[0, axis] = hits[0, axis]
    for k in range(order):
        p = sequences[row, order - 1 - k] if backwards else sequences[row, k]
        height = (
            normal[p, 0] * images[k, 0]
            + normal[p, 1] * images[k, 1]
            + normal[p, 2] * images[k, 2]
            - offset[p]
        )
        for axis in range(3):
            images[k + 1, axis] = images[k, axis] - 2.0 * height * normal[p, axis]
    for k in range(order, 0, -1):
        p = sequences[row, order - k] if backwards else sequences[row, k - 1]
        far, near = -offset[p], -offset[p]
        for axis in range(3):
            far += normal[p, axis] * images[k, axis]
            near += normal[p, axis] * hits[k + 1, axis]
        # a point on an edge lies on both its planes, give or take rounding
        if abs(far) <= slack or (near if far > 0.0 else -near) > slack:
            return False
        part = near / (near - far)
        for axis in range(3):
            step = images[k, axis] - hits[k + 1, axis]
            hits[k, axis] = hits[k + 1, axis] + part * step
        first, last = face_start[p], face_start[p + 1]
        face = face_at(hits, k, first, last, members, rims, slack)
        if face < 0:
            return False
        faces[k - 1] = face
    return True


@njit(cache=True, nogil=True)
def validate(
    emitter, listeners, who, orders, sequences, panels, blocking, tree, slack, out
):
    """Check candidates; fill `out` and return the mask of those that hold.

    `panels` is (normal, offset, face_start, faces, rims), `blocking` is (blockers,
    of_face, planes), `out` is (length, departure, arrival, faces, image).
    """
    rims, of_face = panels[4], blocking[1]
    nodes, children, packs, holders = tree
    length, departure, arrival, out_faces, image = out
    deepest = sequences.shape[1]
    few = len(blocking[0]) <= LIST
    stack, near = np.empty(DEPTH, dtype=np.int64), np.empty(16, dtype=np.float32)
    distance = np.empty(8 * FEW)
    images, hits = np.empty((deepest + 1, 3)), np.empty((deepest + 2, 3))
    faces = np.empty(deepest + 1, dtype=np.int64)
    valid = np.zeros(len(who), dtype=np.bool_)
    turned = np.empty(len(listeners), dtype=np.bool_)
    for i in range(len(listeners)):
        turned[i] = precedes(listeners[i], emitter)
    for c in range(len(who)):
        order, i = orders[c], who[c]
        back = turned[i]
        for axis in range(3):
            hits[0, axis] = listeners[i, axis] if back else emitter[axis]
            hits[order + 1, axis] = emitter[axis] if back else listeners[i, axis]
        if not follow(sequences, c, order, back, panels, slack, images, hits, faces):
            continue
        free = True
        for k in range(order + 1):
            one = of_face[faces[k - 1]] if k > 0 else -1
            other = of_face[faces[k]] if k < order else -1
            if few:
                free = not blocked_by(hits, k, one, other, blocking, rims, slack)
            else:
                free = is_free(
                    nodes,
                    children,
                    packs,
                    holders,
                    of_face,
                    hits[k],
                    hits[k + 1],
                    one,
                    other,
                    slack,
                    stack,
                    near,
                    distance,
                )
            if not free:
                break
        if not free:
            continue
        valid[c] = True
        total = 0.0
        for axis in range(3):
            step = hits[order + 1, axis] - images[order, axis]
            image[c, axis] = images[order, axis]
            total += step * step
        length[c] = np.sqrt(total)
        point_at(hits, 0, 1, arrival if back else departure, c)
        point_at(hits, order + 1, order, departure if back else arrival, c)
        for k in range(order):
            out_faces[c, k] = faces[order - 1 - k] if back else faces[k]
    return valid


@njit(cache=True, nogil=True)
def point_at(points, origin, target, out, row):
    """Write the unit vector from one point to another; zero if they coincide."""
    dx = points[target, 0] - points[origin, 0]
    dy = points[target, 1] - points[origin, 1]
    dz = points[target, 2] - points[origin, 2]
    size = np.sqrt(dx * dx + dy * dy + dz * dz)
    size = size if size > 0.0 else 1.0
    out[row, 0], out[row, 1], out[row, 2] = dx / size, dy / size, dz / size


@njit(cache=True, nogil=True)
def in_order(a, b, length, image):
    """Tell whether path a comes before path b: by length, then by image."""
    if length[a] != length[b]:
        return length[a] < length[b]
    for axis in range(3):
        if image[a, axis] != image[b, axis]:
            return image[a, axis] < image[b, axis]
    return True


@njit(cache=True, nogil=True)
def arrange(who, valid, length, image, listeners, near):
    """Return the rows that hold, by listener and length, each path once.

    Two paths of one listener with the same image are one path: an edge or a doubled
    panel has let it through twice.
    """
    start = np.zeros(listeners + 1, dtype=np.int64)
    for i in range(len(who)):
        if valid[i]:
            start[who[i] + 1] += 1
    start = np.cumsum(start)
    rows = np.empty(start[-1], dtype=np.int64)
    filled = start.copy()
    for i in range(len(who)):
        if valid[i]:
            rows[filled[who[i]]] = i
            filled[who[i]] += 1
    double = np.zeros(len(rows), dtype=np.bool_)
    for k in range(listeners):
        own = rows[start[k] : start[k + 1]]
        own[:] = own[np.argsort(length[own])]
        for i in range(1, len(own)):
            j = i
            while j > 0 and not in_order(own[j - 1], own[j], length, image):
                own[j - 1], own[j] = own[j], own[j - 1]
                j -= 1
        for i in range(len(own)):
            j = i + 1
            while j < len(own) and length[own[j]] - length[own[i]] <= near:
                apart = 0.0
                for axis in range(3):
                    gap = abs(image[own[i], axis] - image[own[j], axis])
                    apart = max(apart, gap)
                if apart <= near:
                    double[start[k] + j] = True
                j += 1
    return rows[~double]
