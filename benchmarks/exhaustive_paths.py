"""Find mirror paths by trying every sequence, for comparison with the search.

Nothing is shared with `rooms.mesh`: a sequence gives an image, the image a
direction, and a ray in that direction must meet exactly these panels and then
reach the listener, going from one nearest hit to the next.
"""

from typing import Any

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def nearest_hit(origin, way, corners, skip, of_face):
    best, face = np.inf, -1
    for f in range(len(corners)):
        if of_face[f] == skip:
            continue
        a = corners[f, 0]
        e1, e2 = corners[f, 1] - a, corners[f, 2] - a
        h = np.cross(way, e2)
        det = e1 @ h
        if det == 0.0:
            continue
        s = origin - a
        u = (s @ h) / det
        q = np.cross(s, e1)
        v = (way @ q) / det
        t = (e2 @ q) / det
        if u >= 0.0 and v >= 0.0 and u + v <= 1.0 and 1e-9 < t < best:
            best, face = t, f
    return best, face


@njit(cache=True, nogil=True)
def walks(emitter, listener, image, sequence, order, corners, normal, of_face):
    """Follow the ray that the image promises; tell whether it arrives."""
    back = listener - image
    total = np.sqrt(back @ back)
    way = back / total
    for k in range(order - 1, -1, -1):
        n = normal[sequence[k]]
        way = way - 2.0 * (way @ n) * n
    here, skip, gone = emitter.copy(), -1, 0.0
    for k in range(order):
        t, face = nearest_hit(here, way, corners, skip, of_face)
        if face < 0 or of_face[face] != sequence[k]:
            return False
        here = here + t * way
        skip, gone = of_face[face], gone + t
        n = normal[skip]
        way = way - 2.0 * (way @ n) * n
    t, _ = nearest_hit(here, way, corners, skip, of_face)
    return t > total - gone - 1e-9


@njit(cache=True, nogil=True)
def every_path(
    emitter, listeners, max_order, corners, normal, offset, of_face, lengths
):
    """Try all sequences; write (listener, length) rows and return their number."""
    panels, found = len(offset), 0
    sequence = np.zeros(max_order, dtype=np.int64)
    images = np.empty((max_order + 1, 3))
    images[0] = emitter
    depth = 0
    sequence[0] = -1
    while depth >= 0:
        sequence[depth] += 1
        p = sequence[depth]
        if p == panels:
            depth -= 1
            continue
        if depth > 0 and sequence[depth - 1] == p:
            continue
        n = normal[p]
        images[depth + 1] = images[depth] - 2.0 * (images[depth] @ n - offset[p]) * n
        for i in range(len(listeners)):
            image = images[depth + 1]
            # the image must lie behind the last mirror
            if (image @ n - offset[p]) * (listeners[i] @ n - offset[p]) >= 0.0:
                continue
            if walks(
                emitter,
                listeners[i],
                image,
                sequence,
                depth + 1,
                corners,
                normal,
                of_face,
            ):
                back = listeners[i] - image
                lengths[found, 0], lengths[found, 1] = i, np.sqrt(back @ back)
                found += 1
        if depth + 1 < max_order:
            depth += 1
            sequence[depth] = -1
    return found


def list_exhaustively(
    geometry: Any, emitter: np.ndarray, listeners: np.ndarray, max_order: int
) -> np.ndarray:
    """Return rows (listener, length) of all reflected paths, sorted."""
    rows = np.empty((200_000, 2))
    panels = geometry.panels
    count = every_path(
        emitter - geometry.origin,
        listeners - geometry.origin,
        max_order,
        geometry.corners,
        panels.normal,
        panels.offset,
        panels.of_face,
        rows,
    )
    rows = rows[:count]
    return rows[np.lexsort((rows[:, 1], rows[:, 0]))]


def random_room(rng: np.random.Generator) -> Any:
    """Return a random non-convex room with slanted walls and 6 to 9 panels."""
    from rooms.mesh import MeshGeometry

    while True:
        n = int(rng.integers(4, 8))
        angle = np.sort(rng.uniform(0, 2 * np.pi, n))
        if np.diff([*angle, angle[0] + 2 * np.pi]).max() > 2.8:
            continue
        reach = rng.uniform(1.5, 5.0, (n, 1))
        floor = reach * np.column_stack([np.cos(angle), np.sin(angle)])
        room = MeshGeometry.extruded(floor, rng.uniform(2.5, 4))
        slant = np.eye(3) + rng.uniform(-0.2, 0.2, (3, 3))
        corners = (room.vertices + room.origin) @ slant.T
        room = MeshGeometry.from_arrays(corners, room.faces, room.face_surface)
        if not room.convex:
            return room


def random_places(geometry: Any, count: int, rng: np.random.Generator) -> np.ndarray:
    """Return points inside a room, shape (count, 3)."""
    low, high = geometry.vertices.min(axis=0), geometry.vertices.max(axis=0)
    points = np.empty((0, 3))
    while len(points) < count:
        drawn = rng.uniform(low, high, (4 * count, 3)) + geometry.origin
        points = np.concatenate([points, drawn[~geometry.outside(drawn)]])
    return points[:count]
