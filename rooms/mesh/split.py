"""Compiled choice of where to cut a group of boxes in two."""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def best_split(low, high, middle, group):
    """Return the group in an order and the place where cutting it costs least."""
    count = len(group)
    best, cut = np.inf, count // 2
    chosen = group.copy()
    after = np.empty(count)
    reach_low, reach_high = np.empty(3), np.empty(3)
    for axis in range(3):
        order = group[np.argsort(middle[group, axis])]
        for backwards in (True, False):
            reach_low[:], reach_high[:] = np.inf, -np.inf
            for step in range(count):
                i = count - 1 - step if backwards else step
                face = order[i]
                for k in range(3):
                    reach_low[k] = min(reach_low[k], low[face, k])
                    reach_high[k] = max(reach_high[k], high[face, k])
                x, y, z = (
                    reach_high[0] - reach_low[0],
                    reach_high[1] - reach_low[1],
                    reach_high[2] - reach_low[2],
                )
                area = x * y + y * z + z * x
                if backwards:
                    after[i] = area * ((step + 8) // 8)
                elif step + 1 < count:
                    cost = area * ((step + 8) // 8) + after[i + 1]
                    if cost < best:
                        best, cut = cost, i + 1
                        chosen[:] = order
    return chosen, cut
