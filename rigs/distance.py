"""Distances between moving balls and boxes."""

import numpy as np

SECTIONS = 48


def segment_box_distance(
    start: np.ndarray, end: np.ndarray, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Return the distance between segments and axis-aligned boxes, m.

    The distance along a segment is convex, so it is found by golden section.

    Parameters
    ----------
    start, end, low, high
        Shape (..., 3), broadcast against each other.

    Examples
    --------
    >>> box = np.array([1.0, 1, 1]), np.array([2.0, 2, 2])
    >>> ends = np.array([0.0, 0, 1.5]), np.array([3.0, 0.5, 1.5])
    >>> round(float(segment_box_distance(*ends, *box)), 6)
    0.657596
    """
    shape = np.broadcast_shapes(start.shape, end.shape, low.shape, high.shape)[:-1]
    ratio = (np.sqrt(5.0) - 1.0) / 2.0
    a, b = np.zeros(shape), np.ones(shape)
    way = end - start

    def gap(share: np.ndarray) -> np.ndarray:
        point = start + share[..., None] * way
        outside = np.maximum(np.maximum(low - point, point - high), 0.0)
        return np.einsum("...k,...k->...", outside, outside)

    left, right = b - ratio * (b - a), a + ratio * (b - a)
    at_left, at_right = gap(left), gap(right)
    for _ in range(SECTIONS):
        lower = at_left <= at_right
        a, b = np.where(lower, a, left), np.where(lower, right, b)
        left, right = b - ratio * (b - a), a + ratio * (b - a)
        at_left, at_right = gap(left), gap(right)
    best = np.minimum(
        gap((a + b) / 2), np.minimum(gap(np.zeros(shape)), gap(np.ones(shape)))
    )
    return np.sqrt(best)


def segment_point_distance(
    start: np.ndarray, end: np.ndarray, point: np.ndarray
) -> np.ndarray:
    """Return the distance between segments and points, shape (..., 3), m."""
    way = end - start
    length = np.einsum("...k,...k->...", way, way)
    along = np.einsum("...k,...k->...", point - start, way)
    share = np.clip(along / np.maximum(length, 1e-30), 0.0, 1.0)
    return np.linalg.norm(start + share[..., None] * way - point, axis=-1)
