"""Put meshes right as far as that is safe, and say what was done."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir.errors import SceneError

__all__ = ["Repaired", "repair"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
_WELD = 1e-7
"""Corners closer than this share of the size are one."""


@dataclass(frozen=True, eq=False)
class Repaired:
    """A mesh after repair, with remarks for people."""

    vertices: FloatArray
    triangles: IntArray
    surface: IntArray
    closed: bool
    remarks: tuple[str, ...]


def repair(vertices: ArrayLike, triangles: ArrayLike, surface: ArrayLike) -> Repaired:
    """Weld corners, drop degenerate and duplicate triangles, turn normals inwards.

    Raises
    ------
    SceneError
        If the arrays do not describe triangles, or none with an area is left.
    """
    points = np.asarray(vertices, dtype=float)
    corners = np.asarray(triangles, dtype=np.int64)
    kinds = np.asarray(surface, dtype=np.int64)
    _check(points, corners, kinds)
    points, corners = _weld(points, corners)
    remarks: list[str] = []
    keep = _areas(points, corners) > 1e-12 * float(np.ptp(points, axis=0).max()) ** 2
    _remark(remarks, len(corners) - int(keep.sum()), "without area dropped")
    corners, kinds = corners[keep], kinds[keep]
    if not len(corners):
        raise SceneError("the mesh has no triangle with an area")
    first = np.sort(np.unique(np.sort(corners, axis=1), axis=0, return_index=True)[1])
    _remark(remarks, len(corners) - len(first), "given twice dropped")
    corners, kinds = corners[first], kinds[first]
    corners, closed = _orient(points, corners, remarks)
    return Repaired(points, corners, kinds, closed, tuple(remarks))


def _check(points: FloatArray, corners: IntArray, kinds: IntArray) -> None:
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise SceneError(f"mesh corners need shape (V, 3), finite; got {points.shape}")
    if corners.ndim != 2 or corners.shape[1] != 3 or not len(corners):
        raise SceneError(f"mesh triangles need shape (T, 3); got {corners.shape}")
    if corners.min() < 0 or corners.max() >= len(points):
        raise SceneError("a mesh triangle names a corner that does not exist")
    if kinds.shape != (len(corners),) or kinds.min() < 0:
        raise SceneError(f"{len(corners)} triangles need as many surface numbers")


def _weld(points: FloatArray, corners: IntArray) -> tuple[FloatArray, IntArray]:
    grid = max(float(np.ptp(points, axis=0).max()), 1e-12) * _WELD
    keys = np.round((points - points.min(axis=0)) / grid).astype(np.int64)
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return points[first], inverse.reshape(-1)[corners]


def _areas(points: FloatArray, corners: IntArray) -> FloatArray:
    a, b, c = (points[corners[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def _remark(remarks: list[str], count: int, what: str) -> None:
    if count:
        remarks.append(f"{count} triangle{'s' if count > 1 else ''} {what}")


def _edges(corners: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return each triangle side as (low, high) corner, its direction, its triangle."""
    ends = corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    forward = np.where(ends[:, 0] < ends[:, 1], 1, -1)
    owner = np.repeat(np.arange(len(corners)), 3)
    return np.sort(ends, axis=1), forward, owner


def _orient(
    points: FloatArray, corners: IntArray, remarks: list[str]
) -> tuple[IntArray, bool]:
    """Give neighbours the same winding; then let normals look into the air."""
    sides, forward, owner = _edges(corners)
    _, index, counts = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
    index = index.reshape(-1)
    open_sides = int(np.sum(counts != 2))
    if open_sides:
        remarks.append(f"open: {open_sides} edges do not join two triangles")
        return corners, False
    order = np.argsort(index, kind="stable").reshape(-1, 2)
    turn, group = _walk(owner[order], forward[order], len(corners))
    _remark(remarks, int(min(turn.sum(), len(turn) - turn.sum())), "turned over")
    corners = np.where(turn[:, None], corners[:, ::-1], corners)
    return _face_air(points, corners, group), True


def _walk(
    pairs: IntArray, forward: IntArray, count: int
) -> tuple[NDArray[np.bool_], IntArray]:
    """Spread a winding over neighbours; return what turns over, and the shells."""
    neighbours: list[list[tuple[int, bool]]] = [[] for _ in range(count)]
    for (one, other), (a, b) in zip(pairs.tolist(), forward.tolist(), strict=True):
        neighbours[one].append((other, a == b))
        neighbours[other].append((one, a == b))
    turn = np.zeros(count, dtype=bool)
    group = np.full(count, -1)
    for seed in range(count):
        if group[seed] >= 0:
            continue
        group[seed], stack = seed, [seed]
        while stack:
            here = stack.pop()
            for there, differs in neighbours[here]:
                if group[there] < 0:
                    group[there] = seed
                    turn[there] = turn[here] ^ differs
                    stack.append(there)
    return turn, group


def _face_air(points: FloatArray, corners: IntArray, group: IntArray) -> IntArray:
    a, b, c = (points[corners[:, k]] - points.mean(axis=0) for k in range(3))
    parts = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    shells = np.unique(group)
    volumes = np.array([parts[group == shell].sum() for shell in shells])
    room = shells[np.argmax(np.abs(volumes))]
    for shell, volume in zip(shells, volumes, strict=True):
        outwards = volume > 0
        if outwards == (shell == room):
            inside = group == shell
            corners[inside] = corners[inside][:, ::-1]
    return corners
