"""Edges that bend sound: those that open more than 180 degrees towards the air."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from rir.arrays import FloatArray, IntArray
from rooms.mesh import MeshGeometry
from rooms.mesh.nearness import nearest_gap

__all__ = ["Edges", "edges_of", "find_edges"]


@dataclass(frozen=True, eq=False)
class Edges:
    """Straight edges with the wedge of air around them.

    Angles around an edge start at its first face and end, through the air, at its
    second. Positions are relative to the origin of the mesh.

    Parameters
    ----------
    start, way : ndarray, shape (M, 3)
        One end [m], and unit vector to the other.
    length : ndarray, shape (M,)
        Length [m].
    tangent, normal : ndarray, shape (M, 3)
        Unit vectors from the edge into the first face, and off it into the air.
    opening : ndarray, shape (M,)
        Angle of the air [rad], above pi; 2 pi for the rim of a thin screen.
    panels, surfaces : ndarray, shape (M, 2)
        Panels and surfaces of the two faces.
    """

    start: FloatArray
    way: FloatArray
    length: FloatArray
    tangent: FloatArray
    normal: FloatArray
    opening: FloatArray
    panels: IntArray
    surfaces: IntArray

    def __len__(self) -> int:
        return len(self.length)

    @property
    def bisector(self) -> FloatArray:
        """Unit vectors into the middle of the air, shape (M, 3)."""
        half = self.opening[:, None] / 2
        return np.cos(half) * self.tangent + np.sin(half) * self.normal


def find_edges(geometry: MeshGeometry, *, least_opening_deg: float = 181.0) -> Edges:
    """Find the edges of a room that diffract.

    Parameters
    ----------
    geometry : MeshGeometry
        The room.
    least_opening_deg : float
        Edges that open less than this towards the air are left out.

    Returns
    -------
    Edges
        Empty for a convex room.

    Examples
    --------
    >>> len(find_edges(MeshGeometry.box((6, 5, 3))))
    0
    """
    rows = []
    for ends, faces in _mesh_edges(geometry):
        wedge = _wedge(geometry, ends, faces)
        if wedge is not None and wedge[5] >= np.radians(least_opening_deg):
            rows.append(wedge)
    if not rows:
        none, flat, whole = np.zeros((0, 3)), np.zeros(0), np.zeros((0, 2), np.int64)
        return Edges(none, none, flat, none, none, flat, whole, whole)
    return Edges(*(np.array(column) for column in zip(*rows, strict=True)))


@lru_cache(maxsize=16)
def edges_of(geometry: MeshGeometry) -> Edges:
    """Return the edges of `find_edges`, found once per room."""
    return find_edges(geometry)


def _mesh_edges(geometry: MeshGeometry) -> Iterator[tuple[IntArray, IntArray]]:
    """Yield the vertices and faces of edges where a panel ends."""
    faces, panel = geometry.faces, geometry.panels.of_face
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    ends, edge = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
    order = np.argsort(edge.ravel(), kind="stable")
    owner = np.tile(np.arange(len(faces)), 3)[order]
    cuts = np.nonzero(np.diff(edge.ravel()[order]))[0] + 1
    for k, members in enumerate(np.split(owner, cuts)):
        # where three or more surfaces meet there is no single wedge
        if len(members) == 1 or (
            len(members) == 2 and panel[members[0]] != panel[members[1]]
        ):
            yield ends[k], members


def _wedge(
    geometry: MeshGeometry, ends: IntArray, faces: IntArray
) -> tuple[Any, ...] | None:
    """Return the row of `Edges` for one edge."""
    start, end = geometry.vertices[ends]
    length = float(np.linalg.norm(end - start))
    way = (end - start) / length
    tangents = []
    for face in faces:
        apex = geometry.corners[face].mean(axis=0) - start
        tangent = apex - (apex @ way) * way
        tangents.append(tangent / np.linalg.norm(tangent))
    normal = geometry.tables.planes[faces[0], :3]
    first, last = tangents[0], tangents[-1]
    opening = float(np.arctan2(last @ normal, last @ first)) % (2 * np.pi)
    if len(faces) == 1:
        others = np.delete(geometry.corners, faces[0], axis=0)
        if nearest_gap(others, (start + end) / 2) <= geometry.tolerance:
            return None  # it stands on another surface
        opening = 2 * np.pi
    elif opening < np.pi:
        sides = geometry.panels.sided[geometry.panels.of_face[faces]]
        if sides.all():
            return None
        # where both sides are air, sound bends around the outer one
        normal, opening = -normal, 2 * np.pi - opening
    both = faces[[0, -1]]
    panels, surfaces = geometry.panels.of_face[both], geometry.face_surface[both]
    return start, way, length, first, normal, opening, panels, surfaces
