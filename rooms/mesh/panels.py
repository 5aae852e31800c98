"""Merge coplanar triangles into panels, so that tessellation does not matter."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray, IntArray
from rooms.mesh.cleaning import edge_table

__all__ = ["Panels", "find_panels"]

_PARALLEL = 1e-5
"""Sine of the angle below which neighbouring triangles may share a plane."""


@dataclass(frozen=True, eq=False)
class Panels:
    """Flat connected regions, each a union of triangles.

    Parameters
    ----------
    normal, offset : ndarray, shape (P, 3), (P,)
        Plane n·x = d of each panel.
    of_face : ndarray, shape (F,)
        Panel of each triangle.
    sided : ndarray of bool, shape (P,)
        Whether only the side the normal points to is air.
    face_start, faces : ndarray, shape (P + 1,), (F,)
        Triangles of panel p: ``faces[face_start[p] : face_start[p + 1]]``.
    hull_start, hull : ndarray, shape (P + 1,), (H, 3)
        Convex outline of each panel.
    center, radius : ndarray, shape (P, 3), (P,)
        Ball around each panel.
    """

    normal: FloatArray
    offset: FloatArray
    of_face: IntArray
    sided: NDArray[np.bool_]
    face_start: IntArray
    faces: IntArray
    hull_start: IntArray
    hull: FloatArray
    center: FloatArray
    radius: FloatArray

    def __len__(self) -> int:
        return len(self.offset)


def find_panels(
    vertices: FloatArray, faces: IntArray, tolerance: float, watertight: bool
) -> Panels:
    """Group triangles into panels.

    Parameters
    ----------
    vertices, faces : ndarray, shape (V, 3), (F, 3)
        A cleaned mesh.
    tolerance : float
        Distance from a plane that still counts as in the plane [m].
    watertight : bool
        Whether normals are known to point into the air.
    """
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    normals = normals / areas[:, None]
    label, seeds = _grow(corners, normals, areas, faces, tolerance)
    label, seeds = _join_touching(corners, normals, label, seeds, tolerance)
    normal = normals[seeds]
    offset = np.einsum("ij,ij->i", normal, corners[seeds, 0])
    agree = np.einsum("ij,ij->i", normals, normal[label]) > 0
    sided = np.full(len(seeds), watertight)
    np.logical_and.at(sided, label, agree)
    order = np.argsort(label, kind="stable")
    start = np.searchsorted(label[order], np.arange(len(seeds) + 1))
    hulls = [
        _outline(corners[order[a:b]].reshape(-1, 3), n)
        for a, b, n in zip(start[:-1], start[1:], normal, strict=True)
    ]
    hull_start = np.cumsum([0, *(len(hull) for hull in hulls)])
    center = np.array([hull.mean(axis=0) for hull in hulls])
    radius = np.array(
        [
            np.linalg.norm(h - c, axis=1).max()
            for h, c in zip(hulls, center, strict=True)
        ]
    )
    hull = np.concatenate(hulls)
    return Panels(
        normal, offset, label, sided, start, order, hull_start, hull, center, radius
    )


def _grow(
    corners: FloatArray,
    normals: FloatArray,
    areas: FloatArray,
    faces: IntArray,
    tolerance: float,
) -> tuple[IntArray, IntArray]:
    """Flood from the largest triangles over edges that do not bend."""
    edge, face, _ = edge_table(faces)
    groups = np.split(face, np.nonzero(np.diff(edge))[0] + 1)
    near: list[list[int]] = [[] for _ in faces]
    for group in groups:
        for one in group:
            near[one].extend(int(other) for other in group if other != one)
    label = np.full(len(faces), -1)
    seeds: list[int] = []
    bend = _PARALLEL**2 / 2 + 1e-12
    for seed in np.argsort(-areas, kind="stable"):
        if label[seed] >= 0:
            continue
        label[seed], stack = len(seeds), [int(seed)]
        plane, level = normals[seed], float(corners[seed, 0] @ normals[seed])
        while stack:
            for other in near[stack.pop()]:
                if label[other] >= 0 or not 1 - abs(normals[other] @ plane) < bend:
                    continue
                if np.abs(corners[other] @ plane - level).max() <= tolerance:
                    label[other] = len(seeds)
                    stack.append(other)
        seeds.append(int(seed))
    return label, np.array(seeds)


def _join_touching(
    corners: FloatArray,
    normals: FloatArray,
    label: IntArray,
    seeds: IntArray,
    tolerance: float,
) -> tuple[IntArray, IntArray]:
    """Join panels of one plane that touch without sharing vertices (T-junctions)."""
    from scipy.spatial import KDTree

    parent = np.arange(len(seeds))
    plane = normals[seeds]
    level = np.einsum("ij,ij->i", plane, corners[seeds, 0])
    lead = np.take_along_axis(plane, np.abs(plane).argmax(axis=1)[:, None], axis=1)
    size = np.abs(corners).max()
    places = np.column_stack([plane * size, level]) * np.sign(lead)
    reach = max(tolerance, _PARALLEL * size)
    for one, other in sorted(KDTree(places).query_pairs(reach)):
        if parent[other] != parent[one] and _touch(
            corners[label == one], corners[label == other], plane[one], tolerance
        ):
            parent[parent == parent[other]] = parent[one]
    roots, joined = np.unique(parent, return_inverse=True)
    return joined[label], seeds[roots]


def _touch(a: FloatArray, b: FloatArray, plane: FloatArray, tolerance: float) -> bool:
    for triangles, points in ((a, b.reshape(-1, 3)), (b, a.reshape(-1, 3))):
        for triangle in triangles:
            sides = np.roll(triangle, -1, axis=0) - triangle
            inward = np.cross(plane, sides)
            inward /= np.linalg.norm(inward, axis=1, keepdims=True)
            if inward[0] @ (triangle[2] - triangle[0]) < 0:
                inward = -inward
            height = np.einsum("sk,psk->ps", inward, points[:, None] - triangle)
            if np.any(height.min(axis=1) >= -tolerance):
                return True
    return False


def _outline(points: FloatArray, normal: FloatArray) -> FloatArray:
    """Return the convex hull of points in a plane, in order (monotone chain)."""
    axis = int(np.argmax(np.abs(normal)))
    keep = [i for i in range(3) if i != axis]
    points = np.unique(points, axis=0)
    points = points[np.lexsort(points[:, keep].T[::-1])]
    flat = points[:, keep]
    ends: list[list[int]] = []
    for order in (range(len(points)), range(len(points) - 1, -1, -1)):
        chain: list[int] = []
        for i in order:
            while len(chain) > 1 and _turn(flat, chain[-2], chain[-1], i) <= 0:
                chain.pop()
            chain.append(i)
        ends.append(chain[:-1])
    return points[ends[0] + ends[1]]


def _turn(p: FloatArray, a: int, b: int, c: int) -> float:
    u, v = p[b] - p[a], p[c] - p[a]
    return float(u[0] * v[1] - u[1] * v[0])
