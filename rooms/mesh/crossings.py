"""What straight ways pass through."""

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray
from rooms.mesh.geometry import MeshGeometry

__all__ = ["find_crossings"]


def find_crossings(
    geometry: MeshGeometry, start: FloatArray, ends: FloatArray
) -> NDArray[np.bool_]:
    """Tell which triangles straight ways to ends (N, 3) cross, shape (N, triangles).

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
    return inside & (t > 1e-9) & (t < 1 - 1e-9) & np.isfinite(safe)
