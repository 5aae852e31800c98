"""Find triangles that make parallelograms, which rays can be tried against as one."""

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray, IntArray
from rooms.mesh.cleaning import edge_table

__all__ = ["pair_up"]


def pair_up(
    vertices: FloatArray, faces: IntArray, group: IntArray, tolerance: float
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Join pairs of triangles into parallelograms.

    Parameters
    ----------
    vertices, faces : ndarray, shape (V, 3), (F, 3)
        A cleaned mesh.
    group : ndarray, shape (F,)
        Only triangles of one group are joined.
    tolerance : float
        How far a corner may be off [m].

    Returns
    -------
    corners : ndarray, shape (F, 3, 3)
        Corners of the triangles. Where two were joined, one stands for both, the
        corner opposite to the joint first; the other has shrunk to a point.
    doubled : ndarray of bool, shape (F,)
        Which stand for two.
    """
    corners = vertices[faces]
    doubled = np.zeros(len(faces), dtype=bool)
    gone = np.zeros(len(faces), dtype=bool)
    edge, face, _ = edge_table(faces)
    first = np.searchsorted(edge, np.nonzero(np.bincount(edge) == 2)[0])
    for one, other in zip(face[first], face[first + 1], strict=True):
        if group[one] != group[other] or (doubled | gone)[[one, other]].any():
            continue
        joint = np.intersect1d(faces[one], faces[other])
        place = int(np.nonzero(~np.isin(faces[one], joint))[0][0])
        mine = faces[one, place]
        theirs = np.setdiff1d(faces[other], joint)[0]
        off = vertices[joint].sum(axis=0) - vertices[mine] - vertices[theirs]
        if np.linalg.norm(off) <= tolerance:
            corners[one] = np.roll(vertices[faces[one]], -place, axis=0)
            doubled[one], gone[other] = True, True
    corners[gone, 1:] = corners[gone, :1]
    return corners, doubled
