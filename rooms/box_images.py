"""Mirror paths of a box one by one, with every reflection on their way.

The image lattice of a box needs no list; effects that look at single reflections
do, for the low orders.
"""

from dataclasses import dataclass

import numpy as np

from rir.arrays import FloatArray, IntArray
from rooms.reflection import Bounces

__all__ = ["NEAREST", "BoxPaths", "box_paths", "walls_met"]

NEAREST = 0.01
"""What is nearer counts as this far [m]: no transducer is a point."""


@dataclass(frozen=True, eq=False)
class BoxPaths:
    """Mirror paths of a box, as a struct of arrays.

    Parameters
    ----------
    listener : ndarray, shape (n,)
        Index of the listener.
    length : ndarray, shape (n,)
        Length [m].
    departure, arrival : ndarray, shape (n, 3)
        Unit vectors out of the emitter, and from the listener to where it comes from.
    order : ndarray, shape (n,)
        Number of reflections.
    rows : ndarray, shape (bounces,)
        Path of each reflection, ascending.
    bounces : Bounces
        All reflections, in their order along each path.
    """

    listener: IntArray
    length: FloatArray
    departure: FloatArray
    arrival: FloatArray
    order: IntArray
    rows: IntArray
    bounces: Bounces

    def __len__(self) -> int:
        return len(self.length)


def box_paths(
    size: FloatArray,
    emitter: FloatArray,
    listeners: FloatArray,
    max_order: int,
    max_length: float = np.inf,
) -> BoxPaths:
    """List the mirror paths of a box, the direct sound left out.

    Parameters
    ----------
    size : ndarray, shape (3,)
        Lengths of the box, a corner of which lies at the origin [m].
    emitter : ndarray, shape (3,)
        Position [m].
    listeners : ndarray, shape (L, 3)
        Positions [m].
    max_order : int
        Most reflections.
    max_length : float
        Longest path [m].

    Examples
    --------
    >>> ends = np.array([1.0, 2.0, 1.0]), np.array([[4.0, 1.0, 1.5]])
    >>> paths = box_paths(np.array([6.0, 5.0, 3.0]), *ends, max_order=2)
    >>> len(paths), len(paths.rows)
    (24, 42)
    """
    index = _indices(max_order)
    even = index % 2 == 0
    image = np.where(even, index * size + emitter, (index + 1) * size - emitter)
    way = (image[None] - listeners[:, None]).reshape(-1, 3)
    length = np.linalg.norm(way, axis=1)
    near = np.nonzero((length <= max_length) & (length > 0))[0]
    listener, which = np.divmod(near, len(index))
    arrival = way[near] / length[near, None]
    # a mirrored axis turns the departure the same way as the arrival
    departure = np.where(even[which], -arrival, arrival)
    rows, bounces = _bounces(
        size, index[which], image[which], listeners[listener], length[near]
    )
    order = np.abs(index).sum(axis=1)[which]
    return BoxPaths(listener, length[near], departure, arrival, order, rows, bounces)


def walls_met(index: IntArray) -> tuple[IntArray, IntArray]:
    """Return how often images met the near and the far wall of an axis.

    Image i > 0 met the far wall first, (i + 1) // 2 times; i < 0 the near one.

    Examples
    --------
    >>> walls_met(np.array([-3, 0, 1, 2]))
    (array([2, 0, 0, 1]), array([1, 0, 1, 1]))
    """
    more, fewer = (np.abs(index) + 1) // 2, np.abs(index) // 2
    return np.where(index > 0, fewer, more), np.where(index > 0, more, fewer)


def _indices(max_order: int) -> IntArray:
    """Return cells of the lattice with 1 to `max_order` reflections, (images, 3)."""
    line = np.arange(-max_order, max_order + 1)
    index = np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1)
    index = index.reshape(-1, 3)
    order = np.abs(index).sum(axis=1)
    return index[(order > 0) & (order <= max_order)]


def _bounces(
    size: FloatArray,
    index: IntArray,
    image: FloatArray,
    listener: FloatArray,
    length: FloatArray,
) -> tuple[IntArray, Bounces]:
    """Cut straight ways from images to listeners at the planes of the lattice."""
    parts = []
    for axis in range(3):
        count = np.abs(index[:, axis])
        rows = np.repeat(np.arange(len(index)), count)
        step = np.arange(len(rows)) - np.repeat(np.cumsum(count) - count, count)
        # the cell of image i > 0 is reached through planes 1…i, of i < 0 through
        # 0…i + 1; odd planes are copies of the far wall
        plane = np.where(index[rows, axis] > 0, 1 + step, -step)
        start, end = image[rows, axis], listener[rows, axis]
        share = (plane * size[axis] - start) / (end - start)
        parts.append((rows, share, 2 * axis + plane % 2))
    rows, share, wall = (np.concatenate(part) for part in zip(*parts, strict=True))
    order = np.lexsort((share, rows))
    rows, share, wall = rows[order], share[order], wall[order]
    way = listener[rows] - image[rows]
    point = image[rows] + share[:, None] * way
    folded = np.abs(point - 2 * size * np.round(point / (2 * size)))
    axis = wall // 2
    folded[np.arange(len(rows)), axis] = (wall % 2) * size[axis]
    across = np.abs(way[np.arange(len(rows)), axis]) / length[rows]
    before = share * length[rows]
    after = (1.0 - share) * length[rows]
    return rows, Bounces(wall, wall, across, before, after, folded)
