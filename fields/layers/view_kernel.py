"""Compiled casting of rays into a mesh; see fields.layers.mesh_views."""

import numpy as np
from numba import njit

from rooms.mesh.hits import DEPTH, FEW, first_hit

__all__ = ["cast"]


@njit(cache=True)
def cast(tree, origins, directions, limit):
    """Return distance and triangle (or -1) of what rays meet, shape (n, rays)."""
    nodes, children, packs, faces = tree
    count, rays = directions.shape[:2]
    owner = np.empty(DEPTH, dtype=np.int64)
    keys = np.empty(DEPTH * 16, dtype=np.int32)
    far = np.empty(8 * FEW)
    distances = np.empty((count, rays))
    met = np.empty((count, rays), dtype=np.int64)
    for row in range(count):
        for ray in range(rays):
            distances[row, ray], met[row, ray] = first_hit(
                nodes,
                children,
                packs,
                faces,
                origins[row, 0],
                origins[row, 1],
                origins[row, 2],
                directions[row, ray, 0],
                directions[row, ray, 1],
                directions[row, ray, 2],
                limit,
                owner,
                keys,
                far,
            )
    return distances, met
