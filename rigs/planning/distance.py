"""Distances between moving balls and boxes."""

import numpy as np

SECTIONS = 36  # golden sections leave 0.618^36 of a way: 0.3 µm of 10 m


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


def segment_segment_distance(
    a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray
) -> np.ndarray:
    """Return the distance between segments a-b and c-d, shapes (..., 3), m.

    Segments may be points.

    References
    ----------
    C. Ericson, Real-Time Collision Detection (2005), section 5.1.9: the closest
    points lie inside both segments, or at an end of one of them.

    Examples
    --------
    >>> x, y, z = np.eye(3)
    >>> float(segment_segment_distance(-x, x, z - y, z + y))
    1.0
    >>> float(segment_segment_distance(x, x, 4 * x, 4 * x))
    3.0
    """
    ends = [_point_gap(a, b, point) for point in (c, d)]
    ends += [_point_gap(c, d, point) for point in (a, b)]
    best = np.minimum.reduce(np.broadcast_arrays(*ends))
    one, two, between = b - a, d - c, a - c
    oo, tt, ot = _dot(one, one), _dot(two, two), _dot(one, two)
    ob, tb = _dot(one, between), _dot(two, between)
    area = oo * tt - ot * ot
    with np.errstate(divide="ignore", invalid="ignore"):
        s, t = (ot * tb - tt * ob) / area, (oo * tb - ot * ob) / area
    inside = (area > 1e-18) & (s > 0) & (s < 1) & (t > 0) & (t < 1)
    s, t = np.where(inside, s, 0.0), np.where(inside, t, 0.0)
    gap = np.linalg.norm(between + s[..., None] * one - t[..., None] * two, axis=-1)
    return np.where(inside, np.minimum(gap, best), best)


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("...k,...k->...", a, b)


def _point_gap(start: np.ndarray, end: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Return the distance between segments and points, shape (..., 3), m."""
    way = end - start
    share = _dot(point - start, way) / np.maximum(_dot(way, way), 1e-30)
    nearest = start + np.clip(share, 0.0, 1.0)[..., None] * way
    return np.linalg.norm(nearest - point, axis=-1)
