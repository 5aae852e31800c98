"""Compiled exact check of mirror sequences, in double precision.

Each pair is followed from the same end whichever emits, so that exchanging the ends
gives the same paths to the last bit.
"""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def precedes(a, b):
    """Tell whether point a comes before b in lexicographic order."""
    for axis in range(3):
        if a[axis] != b[axis]:
            return a[axis] < b[axis]
    return False


@njit(cache=True, nogil=True)
def face_at(point, first, last, faces, rims, slack):
    """Return the triangle of a panel that holds a point of its plane, or -1."""
    for i in range(first, last):
        rim = rims[faces[i]]
        inside = True
        for side in range(3):
            height = (
                rim[side, 0] * point[0]
                + rim[side, 1] * point[1]
                + rim[side, 2] * point[2]
                - rim[side, 3]
            )
            if height < -slack:
                inside = False
                break
        if inside:
            return faces[i]
    return -1


@njit(cache=True, nogil=True)
def blocked_by(a, b, skip_one, skip_other, blockers, of_face, rims, planes, slack):
    """Tell whether a triangle of the list stands between two points.

    Panels on which the segment ends are left out.
    """
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    span = np.sqrt(dx * dx + dy * dy + dz * dz)
    if span <= 2.0 * slack:
        return False
    end = slack / span
    for face in blockers:
        panel = of_face[face]
        if panel in (skip_one, skip_other):
            continue
        nx, ny, nz, d = planes[face]
        start = nx * a[0] + ny * a[1] + nz * a[2] - d
        slope = nx * dx + ny * dy + nz * dz
        if slope == 0.0:
            continue
        part = -start / slope
        if part <= end or part >= 1.0 - end:
            continue
        px, py, pz = a[0] + part * dx, a[1] + part * dy, a[2] + part * dz
        rim = rims[face]
        if (
            rim[0, 0] * px + rim[0, 1] * py + rim[0, 2] * pz - rim[0, 3] >= -slack
            and rim[1, 0] * px + rim[1, 1] * py + rim[1, 2] * pz - rim[1, 3] >= -slack
            and rim[2, 0] * px + rim[2, 1] * py + rim[2, 2] * pz - rim[2, 3] >= -slack
        ):
            return True
    return False


@njit(cache=True, nogil=True)
def follow(start, end, sequence, order, backwards, panels, slack, images, hits, faces):
    """Write the reflection points of one sequence; tell whether they all exist.

    `panels` is (normal, offset, face_start, faces, rims).
    """
    normal, offset, face_start, members, rims = panels
    images[0] = start
    for k in range(order):
        p = sequence[order - 1 - k] if backwards else sequence[k]
        height = (
            normal[p, 0] * images[k, 0]
            + normal[p, 1] * images[k, 1]
            + normal[p, 2] * images[k, 2]
            - offset[p]
        )
        for axis in range(3):
            images[k + 1, axis] = images[k, axis] - 2.0 * height * normal[p, axis]
    hits[order + 1] = end
    hits[0] = start
    for k in range(order, 0, -1):
        p = sequence[order - k] if backwards else sequence[k - 1]
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
        face = face_at(hits[k], face_start[p], face_start[p + 1], members, rims, slack)
        if face < 0:
            return False
        faces[k - 1] = face
    return True


@njit(cache=True, nogil=True)
def validate(emitter, listeners, who, orders, sequences, panels, blocking, slack, out):
    """Check candidates; fill `out` and return the mask of those that hold.

    `blocking` is (blockers, of_face, planes), `out` is (length, departure, arrival,
    faces, image).
    """
    blockers, of_face, planes = blocking
    length, departure, arrival, out_faces, image = out
    rims = panels[4]
    deepest = sequences.shape[1]
    images, hits = np.empty((deepest + 1, 3)), np.empty((deepest + 2, 3))
    faces = np.empty(deepest + 1, dtype=np.int64)
    valid = np.zeros(len(who), dtype=np.bool_)
    for c in range(len(who)):
        order = orders[c]
        listener = listeners[who[c]]
        turned = precedes(listener, emitter)
        start, end = (listener, emitter) if turned else (emitter, listener)
        if not follow(
            start, end, sequences[c], order, turned, panels, slack, images, hits, faces
        ):
            continue
        free = True
        for k in range(order + 1):
            one = of_face[faces[k - 1]] if k > 0 else -1
            other = of_face[faces[k]] if k < order else -1
            if blocked_by(
                hits[k], hits[k + 1], one, other, blockers, of_face, rims, planes, slack
            ):
                free = False
                break
        if not free:
            continue
        valid[c] = True
        total = 0.0
        for axis in range(3):
            step = end[axis] - images[order, axis]
            image[c, axis] = images[order, axis]
            total += step * step
        length[c] = np.sqrt(total)
        leave, enter = (arrival, departure) if turned else (departure, arrival)
        point_at(hits[0], hits[1], leave[c])
        point_at(hits[order + 1], hits[order], enter[c])
        for k in range(order):
            out_faces[c, k] = faces[order - 1 - k] if turned else faces[k]
    return valid


@njit(cache=True, nogil=True)
def point_at(origin, target, out):
    """Write the unit vector from one point to another; zero if they coincide."""
    dx, dy, dz = target[0] - origin[0], target[1] - origin[1], target[2] - origin[2]
    size = np.sqrt(dx * dx + dy * dy + dz * dz)
    size = size if size > 0.0 else 1.0
    out[0], out[1], out[2] = dx / size, dy / size, dz / size


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
