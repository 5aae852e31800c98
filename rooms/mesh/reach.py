"""The space that sound can reach among triangles that do not enclose it.

A point belongs to the room if most directions from it meet a surface, and if it hangs
together with most other such points by free sight. What lies behind the back of a wall
sees less than half of itself walled, and cavities see no room.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit

from rir.arrays import BoolArray, FloatArray, IntArray
from rooms.mesh.hits import DEPTH, FEW, first_hit, free_ways

__all__ = ["Reach", "find_reach"]

_POINTS = 4096
"""Points of the bounding box: the volume to 1 % where half of it is room."""

_WAYS = 64
"""Directions from each; so many misjudge no point that sees 0.7 of itself walled."""

_NEAR, _FAR = 8, 12
"""Neighbours, and points anywhere, that each point looks for."""

_ON_SIDE = 4
"""Points on each side of a triangle that look for the room."""


@dataclass(frozen=True, eq=False)
class Reach:
    """What sound in an open mesh reaches.

    Parameters
    ----------
    volume, error : float
        Volume of the room, 0 if there is none, and its standard error [m³].
    sides : ndarray, shape (F, 2)
        Share of each triangle's sides, against its normal and along it, that the room
        lies on.
    open_share : float
        Share of the directions from points of the room that meet no surface.
    open_length : float
        Length of the edges at which one triangle ends [m].
    """

    volume: float
    error: float
    sides: FloatArray
    open_share: float
    open_length: float

    def described(self, volume: float, area: float) -> str:
        """Return in words how large a room of this volume and area is, and how open."""
        free = 4 * volume / max(area, 1e-9)
        return (
            f"sound reaches about {volume:.4g} m³ (± {self.error:.2g}) and"
            f" {area:.4g} m² of surface, mean free path {free:.2g} m;"
            f" {100 * self.open_share:.2g} % of the directions from inside meet"
            f" nothing, {self.open_length:.3g} m of edges are free"
        )


def find_reach(
    vertices: FloatArray, faces: IntArray, tree: Any, of_face: IntArray
) -> Reach:
    """Estimate the space that sound reaches, from points spread evenly.

    Parameters
    ----------
    vertices, faces : ndarray, shape (V, 3), (F, 3)
        A cleaned mesh.
    tree : tuple of ndarray
        Its hierarchy.
    of_face : ndarray, shape (F,)
        Panel of each triangle.
    """
    corners = vertices[faces]
    low, size = vertices.min(axis=0), np.ptp(vertices, axis=0)
    slack = 1e-9 * float(np.linalg.norm(size))
    points = low + size * _spread(_POINTS)
    nodes, children, packs, holders = tree
    free = _free_share(nodes, children, packs, holders, points, _directions(_WAYS))
    walled = np.nonzero(free < 0.5)[0]
    room = walled[_largest(tree, of_face, points[walled], slack)]
    share = len(room) / _POINTS
    box = float(np.prod(size))
    error = box * float(np.sqrt(share * (1 - share) / _POINTS))
    sides = _sides(corners, tree, of_face, points[room], slack)
    out = float(free[room].mean()) if len(room) else 1.0
    return Reach(box * share, error, sides, out, _open_length(vertices, faces))


def _spread(count: int) -> FloatArray:
    """Return points spread evenly over the unit cube (R3 sequence)."""
    index = np.arange(1, count + 1)[:, None]
    return (0.5 + index / 1.2207440846057596 ** np.arange(1, 4)) % 1


def _directions(count: int) -> FloatArray:
    """Return directions spread evenly over the sphere (Fibonacci grid)."""
    index = np.arange(count) + 0.5
    up, turn = 1 - 2 * index / count, np.pi * (1 + np.sqrt(5)) * index
    flat = np.sqrt(1 - up**2)
    return np.column_stack([flat * np.cos(turn), flat * np.sin(turn), up])


@njit(cache=True, nogil=True)
def _free_share(nodes, children, packs, faces, points, ways):
    """Return the share of directions in which each point meets nothing."""
    owner, keys = np.empty(DEPTH, np.int64), np.empty(16 * DEPTH, np.int32)
    far, share = np.empty(8 * FEW), np.zeros(len(points))
    for i in range(len(points)):
        for k in range(len(ways)):
            _, face = first_hit(
                nodes,
                children,
                packs,
                faces,
                points[i, 0],
                points[i, 1],
                points[i, 2],
                ways[k, 0],
                ways[k, 1],
                ways[k, 2],
                1e30,
                owner,
                keys,
                far,
            )
            share[i] += face < 0
    return share / len(ways)


def _largest(
    tree: Any, of_face: IntArray, points: FloatArray, slack: float
) -> BoolArray:
    """Tell which points belong to the most that see each other, step by step."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count = len(points)
    if count < 2:
        return np.ones(count, dtype=bool)
    start, end = _pairs(points, points)
    seen = free_ways(tree, of_face, points[start], points[end], slack)
    links = coo_array(
        (np.ones(seen.sum(), np.int8), (start[seen], end[seen])), shape=(count, count)
    )
    part = connected_components(links, directed=False)[1]
    return part == np.bincount(part).argmax()


def _pairs(points: FloatArray, others: FloatArray) -> tuple[IntArray, IntArray]:
    """Return each point with its nearest others, and with some from anywhere."""
    from scipy.spatial import KDTree

    near = KDTree(others).query(points, k=min(_NEAR, len(others)))[1]
    anywhere = np.arange(len(points))[:, None] * _FAR + np.arange(_FAR)
    # steps of the golden ratio visit all before any comes again
    anywhere = (anywhere * 0.6180339887498949 % 1 * len(others)).astype(np.int64)
    ends = np.hstack([near.reshape(len(points), -1), anywhere])
    return np.repeat(np.arange(len(points)), ends.shape[1]), ends.ravel()


def _sides(
    corners: FloatArray, tree: Any, of_face: IntArray, room: FloatArray, slack: float
) -> FloatArray:
    """Return the share of each triangle's sides from which the room is seen."""
    if not len(room):
        return np.ones((len(corners), 2))
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    u, v = _spread(_ON_SIDE)[:, :2].T
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    weights = np.stack([1 - u - v, u, v], axis=1)
    on = np.einsum("nk,fkx->fnx", weights, corners)
    shares = []
    for sign in (-1.0, 1.0):
        off = (on + sign * 1e3 * slack * normal[:, None]).reshape(-1, 3)
        start, end = _pairs(off, room)
        ahead = np.einsum(
            "nk,nk->n", room[end] - off[start], sign * normal[start // _ON_SIDE]
        )
        seen = ahead > 0
        some = np.nonzero(seen)[0]
        seen[some] = free_ways(tree, of_face, off[start[some]], room[end[some]], slack)
        found = np.zeros(len(off), dtype=bool)
        found[start[seen]] = True
        shares.append(found.reshape(-1, _ON_SIDE).mean(axis=1))
    return np.stack(shares, axis=1)


def _open_length(vertices: FloatArray, faces: IntArray) -> float:
    """Return the length of edges that only one triangle has [m]."""
    ends = np.sort(
        np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1
    )
    edges, counts = np.unique(ends, axis=0, return_counts=True)
    lone = edges[counts == 1]
    return float(
        np.linalg.norm(vertices[lone[:, 0]] - vertices[lone[:, 1]], axis=1).sum()
    )
