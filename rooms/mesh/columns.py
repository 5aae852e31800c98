"""Which cells of a grid lie in the air: columns of cells against triangles."""

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray, IntArray

__all__ = ["filled_cells"]

_BLOCK = 1_000_000
"""Columns times triangles looked at in one go."""


def filled_cells(
    corners: FloatArray, low: FloatArray, spacing: FloatArray, shape: IntArray
) -> FloatArray:
    """Return 1 for cells whose middle a closed mesh encloses, 0 for others.

    A line up through the middles of a column enters or leaves the air at each triangle
    it meets. Where it meets a side, exactly one of the two triangles counts, whatever
    the rounding.

    Parameters
    ----------
    corners : ndarray, shape (F, 3, 3)
        Corners of the triangles; their normals point into the air.
    low : ndarray, shape (3,)
        Where the grid begins, in the frame of the corners [m].
    spacing : ndarray, shape (3,)
        Size of a cell [m].
    shape : ndarray, shape (3,)
        Cells along each axis.

    Examples
    --------
    >>> from rooms.mesh import MeshGeometry
    >>> room = MeshGeometry.box((3, 2, 2))
    >>> grid = np.array([-2.0, -2, -2]), np.array([1.0, 1, 1]), np.array([4, 4, 4])
    >>> int(filled_cells(room.corners, *grid).sum())
    12
    """
    x, y = ((np.arange(shape[k]) + 0.5) * spacing[k] + low[k] for k in range(2))
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    flat = corners[:, :, :2]
    area = _side(flat[:, 0], flat[:, 1], flat[:, 2][:, None])[:, 0]
    steps = np.zeros((len(points), int(shape[2]) + 1))
    count = max(1, _BLOCK // len(points))
    rising = np.nonzero(area)[0]
    for first in range(0, len(rising), count):
        some = rising[first : first + count]
        column, which = np.nonzero(_covered(flat[some], area[some] > 0, points))
        height = _heights(corners[some[which]], points[column])
        cell = np.ceil((height - low[2]) / spacing[2] - 0.5).astype(np.int64)
        # a normal that points up begins the air, one that points down ends it
        sense = np.sign(area[some[which]])
        np.add.at(steps, (column, np.clip(cell, 0, shape[2])), sense)
    inside = np.cumsum(steps[:, :-1], axis=1) > 0.5
    return inside.reshape(tuple(shape)).astype(float)


def _side(a: FloatArray, b: FloatArray, points: FloatArray) -> FloatArray:
    """Return which side of lines (F, 2) points (F, N, 2) lie on: left is positive.

    Reckoned from the same end whichever way a side runs, so that two triangles agree.
    """
    turned = (a[:, 0] > b[:, 0]) | ((a[:, 0] == b[:, 0]) & (a[:, 1] > b[:, 1]))
    one = np.where(turned[:, None], b, a)
    way = np.where(turned[:, None], a, b) - one
    off = points - one[:, None]
    left = way[:, None, 0] * off[..., 1] - way[:, None, 1] * off[..., 0]
    return np.where(turned[:, None], -left, left)


def _covered(
    flat: FloatArray, left: NDArray[np.bool_], points: FloatArray
) -> NDArray[np.bool_]:
    """Tell which points lie in which triangles seen from above, (points, F)."""
    inside = np.ones((len(flat), len(points)), dtype=bool)
    spread = np.broadcast_to(points, (len(flat), *points.shape))
    for k in range(3):
        a, b = flat[:, k], flat[:, (k + 1) % 3]
        side = _side(a, b, spread)
        side = np.where(left[:, None], side, -side)
        # a point on a side belongs to the triangle on its right, or above it
        way = np.where(left[:, None], b - a, a - b)
        owns = (way[:, 1] < 0) | ((way[:, 1] == 0) & (way[:, 0] > 0))
        inside &= (side > 0) | ((side == 0) & owns[:, None])
    return inside.T


def _heights(corners: FloatArray, points: FloatArray) -> FloatArray:
    """Return how high triangles (n, 3, 3) lie over points (n, 2)."""
    a = corners[:, 0]
    normal = np.cross(corners[:, 1] - a, corners[:, 2] - a)
    off = points - a[:, :2]
    return a[:, 2] - np.einsum("nk,nk->n", normal[:, :2], off) / normal[:, 2]
