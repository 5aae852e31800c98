"""The closed outer shell of a mesh that has open surfaces hanging in it."""

import numpy as np

from rir.arrays import FloatArray, IntArray
from rooms.mesh.cleaning import Cleaned, edge_table

__all__ = ["closed_shell", "hull_volume", "repairs", "signed_volume"]

_WHOLE = 0.99  # of the extent of all: what is smaller stands in the room


def signed_volume(corners: FloatArray) -> float:
    """Return the volume that triangles (F, 3, 3) wind around [m³]."""
    a, b, c = np.moveaxis(corners, 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6


def closed_shell(vertices: FloatArray, faces: IntArray) -> IntArray:
    """Return the triangles of the part that encloses all others, none if none does.

    A part is what hangs together by edges. It is closed if every edge joins two
    triangles, and a shell if it reaches as far as the whole mesh.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> sides = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> closed_shell(corners, sides).tolist()
    [0, 1, 2, 3]
    >>> closed_shell(corners, sides[:3]).tolist()
    []
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    edge, face, _ = edge_table(faces)
    same = np.nonzero(np.diff(edge) == 0)[0]
    ones = np.ones(len(same), dtype=np.int8)
    links = coo_array((ones, (face[same], face[same + 1])), shape=(len(faces),) * 2)
    part = connected_components(links, directed=False)[1]
    closed = np.ones(part.max() + 1, dtype=bool)
    closed[part[face[np.bincount(edge)[edge] != 2]]] = False
    span = _WHOLE * np.ptp(vertices[faces.ravel()], axis=0)
    for k in np.nonzero(closed)[0]:
        some = np.nonzero(part == k)[0]
        if np.all(np.ptp(vertices[faces[some].ravel()], axis=0) >= span):
            return some
    return np.zeros(0, dtype=np.int64)


def repairs(mesh: Cleaned, panels: int) -> tuple[str, ...]:
    """Return in words what was repaired, merged into panels, and left open."""
    done = [*mesh.report]
    if panels < len(mesh.faces):
        done.append(f"merged {len(mesh.faces)} triangles into {panels} panels")
    if not mesh.watertight:
        open_ = "the mesh does not enclose the air: both sides of it reflect"
        if len(closed_shell(mesh.vertices, mesh.faces)):
            open_ = "open surfaces stand in a closed shell: both sides of all reflect"
        done.append(open_)
    return tuple(done)


def hull_volume(vertices: FloatArray) -> float:
    """Return the volume of the convex hull of points, 0 if they lie in a plane."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return float(ConvexHull(vertices).volume)
    except QhullError:
        return 0.0
