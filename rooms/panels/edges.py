"""Borders of panels: what stands there, and how wide the air opens."""

from dataclasses import dataclass

import numpy as np

from rir.arrays import FloatArray, IntArray
from rooms.mesh import MeshGeometry

__all__ = ["Borders", "find_borders"]

_SHARP = np.radians(240)
"""Edges that open less are closed by nothing but their neighbours."""

_SLIT = 0.05
"""Gap [m] below furniture through which no sound goes: a quarter of a wave at 1.7 kHz,
above which panels as large as to matter mirror all there is."""

_BLOCK = 4_000_000  # pairs of borders and panels looked at in one go: 32 MB


@dataclass(frozen=True, eq=False)
class Borders:
    """Straight borders of panels, each belonging to one triangle.

    Columns are the side of the panel: 0 the one its normal points to, 1 the other.

    Parameters
    ----------
    panel : ndarray, shape (B,)
        The panel that ends here.
    length : ndarray, shape (B,)
        Length [m].
    outward : ndarray, shape (B, 3)
        Unit vector in the plane of the panel, away from it.
    bend : ndarray, shape (B, 2)
        Angle between the plane and what continues the panel, at most a right one
        [rad].
    passage : ndarray, shape (B, 2)
        How freely sound passes around: 0 into corners, 1 around a rim.
    mirrored : ndarray, shape (B, 2)
        1 where the panel's own image continues it, else 0.
    """

    panel: IntArray
    length: FloatArray
    outward: FloatArray
    bend: FloatArray
    passage: FloatArray
    mirrored: FloatArray


def find_borders(geometry: MeshGeometry) -> Borders:
    """Return where panels end, and what stands there."""
    panel = np.tile(geometry.panels.of_face, 3)
    face = np.tile(np.arange(len(geometry.faces)), 3)
    start, way, length, into = _frames(geometry)
    normal = geometry.panels.normal[panel]
    opening = np.full((len(face), 2), 2 * np.pi)
    inner = np.zeros(len(face), dtype=bool)
    one, other = _neighbours(geometry)
    inner[one] |= panel[one] == panel[other]
    _narrow(opening, one, normal[one], into[one], into[other])
    # what no neighbour continues may stand on something, or close to it
    sharp = np.nonzero(~inner & (opening.max(axis=1) > _SHARP))[0]
    middle = start[sharp] + way[sharp] * length[sharp, None] / 2
    known = set(zip(one.tolist(), panel[other].tolist(), strict=True))
    reach = np.clip(length[sharp] / 10, 2 * geometry.tolerance, _SLIT)
    at, below = _standing(geometry, middle, panel[sharp], reach)
    new = [
        (row, on) not in known
        for row, on in zip(sharp[at].tolist(), below.tolist(), strict=True)
    ]
    one, below = sharp[at][new], below[new]
    # what it stands on goes on to both sides
    lying = np.cross(geometry.panels.normal[below], way[one])
    for sense in (1.0, -1.0):
        _narrow(opening, one, normal[one], into[one], sense * lying)
    rows = np.nonzero(~inner)[0]
    opening = np.maximum(opening[rows], 1e-6)
    copies = np.maximum(np.rint(np.pi / opening), 1.0)
    bend = np.minimum(np.abs(copies * opening - np.pi), np.pi / 2)
    # pressure at the edge of a wedge over that on a wall: 2 pi / opening - 1 more
    passage = np.where(opening > np.pi, 2 - 2 * np.pi / opening, 0.0)
    passage *= np.sin(bend) ** 2
    mirrored = (copies % 2 == 0).astype(float)
    return Borders(panel[rows], length[rows], -into[rows], bend, passage, mirrored)


def _frames(
    geometry: MeshGeometry,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return start, way and length of the sides of triangles, and the way into them.

    Rows run over the first sides of all triangles, then the second and third.
    """
    corners = geometry.corners
    start = np.concatenate([corners[:, k] for k in range(3)])
    end = np.concatenate([corners[:, (k + 1) % 3] for k in range(3)])
    apex = np.concatenate([corners[:, (k + 2) % 3] for k in range(3)])
    length = np.linalg.norm(end - start, axis=1)
    way = (end - start) / length[:, None]
    into = apex - start
    into -= np.einsum("ij,ij->i", into, way)[:, None] * way
    into /= np.linalg.norm(into, axis=1, keepdims=True)
    return start, way, length, into


def _neighbours(geometry: MeshGeometry) -> tuple[IntArray, IntArray]:
    """Return all ordered pairs of sides that lie on the same edge."""
    faces = geometry.faces
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    _, edge = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
    edge = edge.ravel()
    order = np.argsort(edge, kind="stable")
    one, other = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    most = int(np.bincount(edge).max(initial=0))
    for gap in range(1, most):
        same = np.nonzero(edge[order[gap:]] == edge[order[:-gap]])[0]
        one += [order[same], order[same + gap]]
        other += [order[same + gap], order[same]]
    return np.concatenate(one), np.concatenate(other)


def _narrow(
    opening: FloatArray,
    rows: IntArray,
    normal: FloatArray,
    into: FloatArray,
    other: FloatArray,
) -> None:
    """Let faces that begin at an edge close the air on both sides of a panel."""
    sine = np.einsum("ij,ij->i", other, normal)
    cosine = np.einsum("ij,ij->i", other, into)
    angle = np.arctan2(sine, cosine) % (2 * np.pi)
    np.minimum.at(opening[:, 0], rows, angle)
    np.minimum.at(opening[:, 1], rows, 2 * np.pi - angle)


def _standing(
    geometry: MeshGeometry, points: FloatArray, own: IntArray, reach: FloatArray
) -> tuple[IntArray, IntArray]:
    """Return which points lie on or near a panel other than their own, and on which.

    What is near must stand off the own panel by half a right angle at least.
    """
    panels, rims = geometry.panels, geometry.tables.rims
    touch = 2 * geometry.tolerance
    found, below = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    step = max(1, _BLOCK // max(1, len(panels)))
    for first in range(0, len(points), step):
        some = slice(first, first + step)
        part, mine = points[some], own[some]
        height = np.abs(part @ panels.normal.T - panels.offset)
        height[np.arange(len(part)), mine] = np.inf
        steep = np.abs(panels.normal[mine] @ panels.normal.T) <= np.sqrt(0.5)
        near = (height <= touch) | (steep & (height <= reach[some, None]))
        for point, panel in np.argwhere(near):
            faces = panels.faces[slice(*panels.face_start[panel : panel + 2])]
            depth = rims[faces, :, :3] @ part[point] - rims[faces, :, 3]
            if np.any(np.all(depth >= -touch, axis=1)):
                found.append(np.array([first + point]))
                below.append(np.array([panel]))
    return np.concatenate(found), np.concatenate(below)
