"""Compiled reading of a hash grid and spreading of its gradient."""

import numpy as np
from numba import njit

__all__ = ["read_grid", "spread_gradient"]


@njit(cache=True, inline="always")
def _entry(x, y, z, mask):
    return (x ^ (y * np.int64(2654435761)) ^ (z * np.int64(805459861))) & mask


@njit(cache=True, inline="always")
def _cell(place, size):
    """Return a place's cell, and where in the cell it lies."""
    px, py, pz = place * np.float32(size)
    cx = min(max(np.int64(px), 0), size - 1)
    cy = min(max(np.int64(py), 0), size - 1)
    cz = min(max(np.int64(pz), 0), size - 1)
    return (cx, cy, cz), (px - cx, py - cy, pz - cz)


@njit(cache=True, inline="always")
def _corner(cell, part, corner, mask):
    """Return the table's entry of a cell's corner, and the corner's weight."""
    a, b, c = corner >> 2, (corner >> 1) & 1, corner & 1
    share = (part[0] if a else 1 - part[0]) * (part[1] if b else 1 - part[1])
    share *= part[2] if c else 1 - part[2]
    return _entry(cell[0] + a, cell[1] + b, cell[2] + c, mask), share


@njit(cache=True)
def read_grid(unit, table, resolutions):
    """Interpolate table entries; shape (points, levels * features)."""
    levels, entries, features = table.shape
    found = np.zeros((len(unit), levels * features), dtype=np.float32)
    mask = np.int64(entries - 1)
    for level in range(levels):
        size = resolutions[level]
        for point in range(len(unit)):
            cell, part = _cell(unit[point], size)
            for corner in range(8):
                index, share = _corner(cell, part, corner, mask)
                for k in range(features):
                    found[point, level * features + k] += share * table[level, index, k]
    return found


@njit(cache=True)
def spread_gradient(unit, shape, resolutions, gradient):
    """Return the gradient of the table."""
    levels, entries, features = shape
    spread = np.zeros(shape, dtype=np.float32)
    mask = np.int64(entries - 1)
    for level in range(levels):
        size = resolutions[level]
        for point in range(len(unit)):
            cell, part = _cell(unit[point], size)
            for corner in range(8):
                index, share = _corner(cell, part, corner, mask)
                for k in range(features):
                    spread[level, index, k] += (
                        share * gradient[point, level * features + k]
                    )
    return spread
