"""Which mirror paths lead from end to end in a room of flat faces."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inverse.paths.polyhedron import Polyhedron
from inverse.rows.fitset import place_numbers
from rir.arrays import FloatArray, IntArray

__all__ = ["PathList", "list_paths"]

MOST_NODES = 400_000
"""Nodes of the tree for one emitter; a deeper tree than that takes seconds."""


@dataclass(frozen=True, eq=False)
class PathList:
    """Hold the paths of rows, sorted by row."""

    starts: IntArray
    """Paths of row r: ``starts[r] : starts[r + 1]``. Shape (rows + 1,)."""
    order: IntArray
    """Reflections of each path. Shape (n,)."""
    walls: NDArray[np.int32]
    """Planes met in order, then -1. Shape (n, K)."""

    @property
    def row(self) -> IntArray:
        """Row of each path, shape (n,)."""
        return np.repeat(np.arange(len(self.starts) - 1), np.diff(self.starts))

    def met(self, planes: int) -> IntArray:
        """Return how many paths meet each plane, shape (planes,)."""
        return np.bincount(self.walls[self.walls >= 0], minlength=planes)

    def below(self, order: int) -> "PathList":
        """Return the paths of at most so many reflections."""
        kept = self.order <= order
        counts = np.bincount(self.row[kept], minlength=len(self.starts) - 1)
        starts = np.concatenate([[0], np.cumsum(counts)])
        width = max(int(self.order[kept].max(initial=0)), 1)
        walls = np.ascontiguousarray(self.walls[kept, :width])
        return PathList(starts, self.order[kept], walls)


def list_paths(
    shape: Polyhedron,
    emitters: FloatArray,
    listeners: FloatArray,
    max_order: int,
    max_length: float,
) -> PathList:
    """Return all free mirror paths of rows, shape (rows, 3) at both ends.

    A tree is grown from the end that has fewer places. Where a tree would grow
    too large its order is lowered.
    """
    from rooms.mesh.images import find_paths

    turned = len(np.unique(place_numbers(listeners))) < len(
        np.unique(place_numbers(emitters))
    )
    first, second = (listeners, emitters) if turned else (emitters, listeners)
    rows, orders, walls = [], [], []
    places = place_numbers(first)
    order = max_order
    for place in range(int(places.max(initial=-1)) + 1):
        mine = np.flatnonzero(places == place)
        while True:
            found = find_paths(
                shape.mesh,
                first[mine[0]],
                second[mine],
                max_order=order,
                max_length=max_length,
                max_nodes=MOST_NODES,
            )
            if found.complete or order <= 2:
                break
            order -= 1
        met = found.surfaces
        rows.append(mine[found.listener])
        orders.append(found.order)
        walls.append(_reversed(met, found.order) if turned else met)
    return _gathered(rows, orders, walls, len(first))


def _reversed(walls: NDArray[np.int32], order: IntArray) -> NDArray[np.int32]:
    if walls.shape[1] == 0:
        return walls
    back = order[:, None] - 1 - np.arange(walls.shape[1])
    picked = np.take_along_axis(walls, np.maximum(back, 0), axis=1)
    return np.where(back >= 0, picked, -1).astype(np.int32)


def _gathered(
    rows: list[IntArray],
    orders: list[IntArray],
    walls: list[NDArray[np.int32]],
    count: int,
) -> PathList:
    row = np.concatenate([np.empty(0, np.int64), *rows])
    order = np.concatenate([np.empty(0, np.int64), *orders])
    width = max(int(order.max(initial=0)), 1)
    table = np.full((len(row), width), -1, dtype=np.int32)
    start = 0
    for part in walls:
        kept = min(width, part.shape[1])
        table[start : start + len(part), :kept] = part[:, :kept]
        start += len(part)
    sort = np.argsort(row, kind="stable")
    starts = np.searchsorted(row[sort], np.arange(count + 1))
    return PathList(starts, order[sort], np.ascontiguousarray(table[sort]))
