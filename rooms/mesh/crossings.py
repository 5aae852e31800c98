"""What straight ways pass through."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rooms.mesh.triangles import Triangles

__all__ = ["Crossings", "find_crossings"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Crossings:
    """Triangles in the way of straight ways.

    Parameters
    ----------
    hit : ndarray of bool, shape (ways, triangles)
        Whether a way crosses a triangle.
    surface : ndarray, shape (triangles,)
        Surface of each triangle.
    """

    hit: NDArray[np.bool_]
    surface: NDArray[np.int64]


def find_crossings(
    geometry: Triangles, start: FloatArray, ends: FloatArray
) -> Crossings:
    """Tell which triangles each straight way, to ends of shape (N, 3), crosses.

    References
    ----------
    T. Möller, B. Trumbore, J. Graphics Tools 2(1), 21 (1997).
    """
    corners = geometry.corners + geometry.origin
    a, b, c = np.moveaxis(corners, 1, 0)
    way = (ends - start)[:, None]
    across = np.cross(way, c - a)
    volume = np.einsum("nti,ti->nt", across, b - a)
    safe = np.where(np.abs(volume) > 1e-12, volume, np.inf)
    u = np.einsum("nti,ti->nt", across, start - a) / safe
    other = np.cross(start - a, b - a)
    v = np.einsum("nti,ti->nt", np.broadcast_to(way, across.shape), other) / safe
    t = np.einsum("ti,ti->t", c - a, other) / safe
    # one of two triangles that share the side a way passes through
    inside = (u >= 0) & (v >= 0) & (u + v < 1)
    hit = inside & (t > 1e-9) & (t < 1 - 1e-9) & np.isfinite(safe)
    return Crossings(hit, geometry.face_surface)
