"""Cut simple polygons into triangles."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir.arrays import FloatArray
from rir.errors import SceneError

__all__ = ["cut_ears", "cut_face"]


def cut_ears(polygon: ArrayLike) -> tuple[FloatArray, NDArray[np.int64]]:
    """Cut a simple polygon into triangles, ear by ear.

    Parameters
    ----------
    polygon : array_like, shape (n, 2)
        Corners in order, either way round.

    Returns
    -------
    corners : ndarray, shape (n, 2)
        Corners, counter-clockwise.
    triangles : ndarray, shape (n - 2, 3)
        Corner indices.

    Raises
    ------
    SceneError
        If the polygon has no area or crosses itself.

    References
    ----------
    G. H. Meisters, Am. Math. Monthly 82, 648 (1975): polygons have ears.
    """
    corners = np.array(polygon, dtype=float)
    if corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3:
        raise SceneError(f"a floor needs 3 or more (x, y), not shape {corners.shape}")
    span = float(np.max(np.ptp(corners, axis=0)))
    if not 1e-6 <= span <= 1e7:
        raise SceneError(f"a floor measures 1e-6 to 1e7 m across, not {span:g} m")
    x, y = corners.T
    area = float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
    if not np.isfinite(area) or area == 0:
        raise SceneError("the floor polygon has no area")
    if _crosses_itself(corners):
        raise SceneError("the floor polygon crosses itself")
    corners = corners if area > 0 else corners[::-1].copy()
    left, triangles = list(range(len(corners))), []
    while len(left) > 3:
        ear = next((k for k in range(len(left)) if _is_ear(corners, left, k)), None)
        if ear is None:
            raise SceneError("the floor polygon touches itself")
        triangles.append(_around(left, ear))
        del left[ear]
    return corners, np.array([*triangles, left], dtype=np.int64)


def _around(left: list[int], k: int) -> list[int]:
    return [left[k - 1], left[k], left[(k + 1) % len(left)]]


def _cross(o: FloatArray, a: FloatArray, b: FloatArray) -> float:
    return float((a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]))


def _crosses_itself(corners: FloatArray) -> bool:
    n = len(corners)
    ends = np.roll(corners, -1, axis=0)
    for i in range(n):
        for j in range(i + 2, n - (i == 0)):
            a, b, c, d = corners[i], ends[i], corners[j], ends[j]
            apart = _cross(a, b, c) * _cross(a, b, d)
            if apart < 0 and _cross(c, d, a) * _cross(c, d, b) < 0:
                return True
    return False


def _is_ear(corners: FloatArray, left: list[int], k: int) -> bool:
    names = _around(left, k)
    a, b, c = corners[names]
    if _cross(a, b, c) <= 0:
        return False
    others = (corners[i] for i in left if i not in names)
    return not any(
        _cross(a, b, p) >= 0 and _cross(b, c, p) >= 0 and _cross(c, a, p) >= 0
        for p in others
    )


def cut_face(
    vertices: Sequence[Sequence[float]], corners: list[int]
) -> list[list[int]]:
    """Return the triangles of a polygon in space, as rows of vertices.

    Raises
    ------
    ValueError
        If it has fewer than three corners.
    """
    if len(corners) < 3:
        raise ValueError(f"a face needs 3 corners, not {len(corners)}")
    if len(corners) == 3:
        return [corners]
    points = np.array([vertices[k] for k in corners])
    ahead = np.roll(points, -1, axis=0)
    normal = np.cross(points, ahead).sum(axis=0)
    axis = int(np.argmax(np.abs(normal)))
    flat = np.delete(points, axis, axis=1)
    turned, ears = cut_ears(flat)
    order = corners if np.array_equal(turned, flat) else corners[::-1]
    return [[order[k] for k in ear] for ear in ears.tolist()]
