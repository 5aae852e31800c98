"""Arrays that describe a mesh, checked."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rir.arrays import FloatArray, IntArray
from rir.errors import SceneError
from rir.numbers import read_array

__all__ = ["check_arrays", "surface_ids"]


def check_arrays(vertices: ArrayLike, faces: ArrayLike) -> tuple[FloatArray, IntArray]:
    """Return vertices (V, 3) and triangles (F, 3), or raise `SceneError`."""
    corners = read_array(vertices, "vertices", "give rows of x, y, z", SceneError)
    raw = read_array(faces, "faces", "give rows of three vertex numbers", SceneError)
    with np.errstate(invalid="ignore"):
        triangles = raw.astype(np.int64)
    if not np.array_equal(triangles, raw):
        raise SceneError("faces must be whole numbers of vertices")
    if corners.ndim != 2 or corners.shape[1] != 3:
        raise SceneError(f"vertices must have shape (V, 3), not {corners.shape}")
    if triangles.ndim != 2 or triangles.shape[1] != 3 or len(triangles) == 0:
        raise SceneError(f"faces must have shape (F, 3), F > 0, not {triangles.shape}")
    if triangles.min() < 0 or triangles.max() >= len(corners):
        raise SceneError(
            f"faces name vertices {triangles.min()}…{triangles.max()},"
            f" but there are {len(corners)}"
        )
    if not np.all(np.isfinite(corners[np.unique(triangles)])):
        raise SceneError("a vertex is not finite")
    span = float(np.ptp(corners[triangles.ravel()], axis=0).max())
    if not 1e-6 <= span <= 1e7:
        raise SceneError(
            f"a mesh measures 1e-6 to 1e7 m across, not {span:g} m; its unit is metres"
        )
    return corners, triangles


def surface_ids(surfaces: Any, count: int) -> tuple[tuple[str, ...], IntArray]:
    """Return the names of the surfaces, and the surface of each triangle."""
    if surfaces is None:
        return ("all",), np.zeros(count, dtype=np.int64)
    if len(surfaces) != count:
        raise SceneError(f"{len(surfaces)} surfaces are stated for {count} triangles")
    if not isinstance(surfaces[0], str):
        ids = read_array(surfaces, "surfaces", "", SceneError).astype(np.int64)
        if ids.min() < 0:
            raise SceneError(f"surface {ids.min()} is negative")
        return tuple(f"surface{k}" for k in range(ids.max() + 1)), ids
    names: Sequence[str] = list(dict.fromkeys(surfaces))
    place = {name: k for k, name in enumerate(names)}
    return tuple(names), np.array([place[name] for name in surfaces], dtype=np.int64)
