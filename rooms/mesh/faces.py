"""Planes and convex faces of a triangle mesh.

Image sources mirror in planes and beams are cut by convex polygons, so coplanar
triangles are joined: a wall is one face however finely it is cut up.
"""

import numpy as np
from numpy.typing import NDArray

__all__ = ["convex_faces", "label_planes"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
_ANGLE = 1e-6


def label_planes(
    corners: FloatArray, normals: FloatArray, *, both_sides: bool
) -> IntArray:
    """Return the number of the plane each triangle lies in, shape (T,).

    Planes facing opposite ways are different, unless `both_sides`.
    """
    size = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    middle = corners.reshape(-1, 3).mean(axis=0)
    level = np.einsum("ij,ij->i", normals, corners.mean(axis=1) - middle)
    if both_sides:
        lead = np.argmax(np.abs(normals) > 0.5, axis=1)
        flip = np.sign(np.take_along_axis(normals, lead[:, None], axis=1))
        normals, level = normals * flip, level * flip[:, 0]
    labels = np.full(len(corners), -1)
    found = 0
    for index in range(len(corners)):
        if labels[index] >= 0:
            continue
        same = np.linalg.norm(normals - normals[index], axis=1) < _ANGLE * 10
        same &= np.abs(level - level[index]) < _ANGLE * size
        labels[same & (labels < 0)] = found
        found += 1
    return labels


def convex_faces(
    vertices: FloatArray, triangles: IntArray, plane: IntArray, surface: IntArray
) -> list[tuple[IntArray, int]]:
    """Join triangles of one plane and surface into convex polygons, greedily.

    Returns
    -------
    list of (ndarray, int)
        Vertex numbers in order, and one triangle of the polygon.

    References
    ----------
    S. Hertel, K. Mehlhorn, "Fast triangulation of simple polygons" (1983): at
    most four times as many pieces as the fewest possible.
    """
    size = float(np.ptp(vertices, axis=0).max())
    faces: list[tuple[IntArray, int]] = []
    for number in range(int(plane.max()) + 1):
        for kind in np.unique(surface[plane == number]):
            members = np.nonzero((plane == number) & (surface == kind))[0]
            polygons = [list(map(int, triangles[m])) for m in members]
            normal = _normal(vertices, polygons[0])
            _orient_all(vertices, polygons, normal)
            merged = _merge(vertices, polygons, normal, size)
            faces += [(np.array(p), int(members[0])) for p in merged]
    return faces


def _normal(vertices: FloatArray, polygon: list[int]) -> FloatArray:
    a, b, c = vertices[polygon[:3]]
    cross = np.cross(b - a, c - a)
    return cross / np.linalg.norm(cross)


def _orient_all(
    vertices: FloatArray, polygons: list[list[int]], normal: FloatArray
) -> None:
    for polygon in polygons:
        if _normal(vertices, polygon) @ normal < 0:
            polygon.reverse()


def _merge(
    vertices: FloatArray, polygons: list[list[int]], normal: FloatArray, size: float
) -> list[list[int]]:
    """Join polygons across shared sides for as long as the result is convex."""
    owner = {
        (p[k], p[(k + 1) % len(p)]): index
        for index, p in enumerate(polygons)
        for k in range(len(p))
    }
    alive = dict(enumerate(polygons))
    pending = list(alive)
    while pending:
        index = pending.pop()
        if index not in alive:
            continue
        joined = _join_one(vertices, alive, owner, index, normal, size)
        if joined is not None:
            pending.append(index)
    return [_straightened(vertices, p, normal, size) for p in alive.values()]


def _join_one(
    vertices: FloatArray,
    alive: dict[int, list[int]],
    owner: dict[tuple[int, int], int],
    index: int,
    normal: FloatArray,
    size: float,
) -> int | None:
    """Join one neighbour to a polygon; return its number, or None."""
    polygon = alive[index]
    for k in range(len(polygon)):
        a, b = polygon[k], polygon[(k + 1) % len(polygon)]
        other = owner.get((b, a))
        if other is None or other == index or other not in alive:
            continue
        joined = _joined(polygon, alive[other], a, b)
        if not _is_convex(vertices, joined, normal, size):
            continue
        del alive[other], owner[a, b], owner[b, a]
        alive[index] = joined
        for j in range(len(joined)):
            owner[joined[j], joined[(j + 1) % len(joined)]] = index
        return other
    return None


def _joined(one: list[int], other: list[int], a: int, b: int) -> list[int]:
    """Return two polygons as one, without their common side a-b."""
    start = one.index(b)
    first = one[start:] + one[:start]
    start = other.index(a)
    second = other[start:] + other[:start]
    return first + second[1:-1]


def _turns(vertices: FloatArray, polygon: list[int], normal: FloatArray) -> FloatArray:
    points = vertices[polygon]
    ahead = np.roll(points, -1, axis=0) - points
    behind = points - np.roll(points, 1, axis=0)
    return np.cross(behind, ahead) @ normal


def _is_convex(
    vertices: FloatArray, polygon: list[int], normal: FloatArray, size: float
) -> bool:
    if len(set(polygon)) != len(polygon):
        return False
    return bool(np.all(_turns(vertices, polygon, normal) > -1e-9 * size**2))


def _straightened(
    vertices: FloatArray, polygon: list[int], normal: FloatArray, size: float
) -> list[int]:
    """Drop corners on straight sides."""
    turns = _turns(vertices, polygon, normal)
    kept = [p for p, turn in zip(polygon, turns, strict=True) if turn > 1e-9 * size**2]
    return kept if len(kept) >= 3 else polygon
