"""Kinds of panels: those of about the same size that end alike."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from rir.arrays import FloatArray, IntArray
from rooms.mesh import MeshGeometry
from rooms.panels.rims import Rims, rims_of

__all__ = ["kinds_of", "parts_of"]

_KINDS = 64
"""Kinds of panels that get a mean of their own, those with most area; others take that
of the nearest kind. Each costs 5 ms, a thin plate 0.05 to 0.3 s once."""


@lru_cache(maxsize=16)
def kinds_of(geometry: MeshGeometry) -> tuple[IntArray, IntArray, IntArray]:
    """Return the kind of each panel and side, and an example of each kind.

    Returns
    -------
    number : ndarray, shape (P, 2)
        Kind of each side of a panel, from 1; 0 where it ends nowhere.
    panel, side : ndarray, shape (kinds,)
        The example.
    """
    rims = rims_of(geometry)
    panel, side = np.nonzero(rims.limited)
    number = np.zeros(rims.limited.shape, dtype=np.int64)
    if not len(panel):
        return number, panel, side
    traits = _traits(rims, panel, side)
    kinds, kind = np.unique(traits, axis=0, return_inverse=True)
    kind = kind.ravel()
    area = np.bincount(kind, rims.area[panel], len(kinds))
    most = np.argsort(-area, kind="stable")[:_KINDS]
    apart = np.abs(kinds[:, None] - kinds[most]).sum(axis=2)
    kind = apart.argmin(axis=1)[kind]
    number[panel, side] = kind + 1
    example = np.array([np.argmax(kind == k) for k in range(len(most))])
    return number, panel[example], side[example]


def _traits(rims: Rims, panel: IntArray, side: IntArray) -> FloatArray:
    """Return what tells kinds apart, in steps of half an octave of size."""
    count = len(panel)
    size = (rims.high - rims.low)[panel, side]
    size = np.where(np.isfinite(size), np.log2(size), 10.0)
    gap = rims.gap[panel, side].reshape(count, 4)
    gap = np.where(np.isfinite(gap), np.log2(np.maximum(gap, 1e-3)), 10.0)
    ends = [part[panel, side].reshape(count, 4) for part in (rims.bend, rims.passage)]
    return np.round(2 * np.concatenate([size, *ends, gap], axis=1))


@lru_cache(maxsize=16)
def parts_of(geometry: MeshGeometry) -> tuple[MeshGeometry, IntArray, IntArray]:
    """Cut the surfaces of a mesh into parts whose panels are of one kind.

    Returns
    -------
    mesh : MeshGeometry
        The same room with a surface for each part.
    surface, panel : ndarray, shape (parts,)
        Surface that each is part of, and one of its panels.
    """
    panel = geometry.panels.of_face
    traits = np.column_stack([geometry.face_surface, kinds_of(geometry)[0][panel]])
    parts, first, part = np.unique(
        traits, axis=0, return_index=True, return_inverse=True
    )
    names = tuple(geometry.surface_names[k] for k in parts[:, 0])
    mesh = replace(geometry, face_surface=part.ravel(), surface_names=names)
    return mesh, parts[:, 0], panel[first]
