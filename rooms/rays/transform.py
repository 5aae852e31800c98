"""Transforms over time of eight columns at once, of which the order does not matter.

Columns are complex and lie side by side: shape (N, 2, 8), N a power of two. The
frequencies come out in an order of their own, in which they can be multiplied; only
the sum of all products needs them sorted.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rir.arrays import FloatArray
from rooms.rays.rows import WIDTH, halve, twist

__all__ = ["find_order", "find_turns", "transform"]


def find_turns(count: int) -> FloatArray:
    """Return what `transform` multiplies by, shape (count, 2)."""
    turn = 2 * np.pi * np.arange(count) / count
    return np.column_stack([np.cos(turn), -np.sin(turn)])


@njit(cache=True, nogil=True)
def transform(work, turns):
    """Transform columns, shape (N, 2, 8), in place, without sorting frequencies.

    W. Gentleman, G. Sande, Proc. AFIPS Fall Joint Conf., 563 (1966).
    """
    count = len(turns)
    size = count
    while size >= 4:
        quarter, step = size >> 2, count // size
        for j in range(quarter):
            for i in range(j, count, size):
                twist(
                    work,
                    i,
                    quarter,
                    turns,
                    turns,
                    turns,
                    j * step,
                    2 * j * step,
                    3 * j * step,
                )
        size = quarter
    if size == 2:
        for i in range(0, count, 2):
            halve(work, i)


def find_order(count: int) -> NDArray[np.int64]:
    """Return the frequency of each row that `transform` leaves.

    Examples
    --------
    >>> find_order(8)
    array([0, 4, 1, 5, 2, 6, 3, 7])
    """
    work = np.zeros((count, 2, WIDTH))
    work[1 % count, 0] = 1.0
    transform(work, find_turns(count))
    turned = -np.angle(work[:, 0, 0] + 1j * work[:, 1, 0]) * count / (2 * np.pi)
    return np.rint(turned).astype(np.int64) % count
