"""Distances from points to the surfaces of a mesh."""

import numpy as np

from rir.arrays import FloatArray
from rooms.mesh.panels import Panels

__all__ = ["distances", "lift_off", "nearest_gap"]


def _nearest(corners: FloatArray, point: FloatArray) -> FloatArray:
    """Return the nearest point of each triangle (F, 3, 3), shape (F, 3)."""
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = np.cross(b - a, c - a)
    square = np.einsum("ij,ij->i", normal, normal)
    height = np.einsum("ij,ij->i", point - a, normal) / square
    foot = point - height[:, None] * normal
    inside = np.ones(len(a), dtype=bool)
    best = np.full(len(a), np.inf)
    near = foot.copy()
    for p, q in ((a, b), (b, c), (c, a)):
        side = q - p
        inside &= np.einsum("ij,ij->i", np.cross(side, foot - p), normal) >= 0
        along = np.einsum("ij,ij->i", point - p, side) / np.einsum(
            "ij,ij->i", side, side
        )
        on = p + np.clip(along, 0, 1)[:, None] * side
        apart = np.linalg.norm(point - on, axis=1)
        closer = apart < best
        best[closer], near[closer] = apart[closer], on[closer]
    near[inside] = foot[inside]
    return near


def nearest_gap(corners: FloatArray, point: FloatArray) -> float:
    """Return how far a point lies from the nearest of triangles (F, 3, 3) [m]."""
    near = _nearest(corners, point)
    return float(np.linalg.norm(near - point, axis=1).min(initial=np.inf))


def distances(corners: FloatArray, points: FloatArray) -> FloatArray:
    """Return how far points (N, 3) lie from the nearest of triangles (F, 3, 3) [m]."""
    return np.array([nearest_gap(corners, point) for point in points])


def lift_off(
    corners: FloatArray, panels: Panels, gap: float, points: FloatArray
) -> FloatArray:
    """Move points, shape (N, 3), that lie on panels off them, by twice a gap [m]."""
    lifted = points.copy()
    height = points @ panels.normal.T - panels.offset
    beside = np.abs(height) <= 2 * gap
    for index in np.nonzero(beside.any(axis=1))[0]:
        for panel in np.nonzero(beside[index])[0]:
            own = panels.faces[slice(*panels.face_start[panel : panel + 2])]
            near = _nearest(corners[own], points[index])
            if np.linalg.norm(near - points[index], axis=1).min() <= 2 * gap:
                rise = 2 * gap - height[index, panel]
                lifted[index] += rise * panels.normal[panel]
    return lifted
