"""Smooth functions on the six walls of a box: products of Legendre polynomials.

Irradiance of scattered sound varies little over a wall, so a few of them describe it;
they are orthonormal over the wall, and the first of each is constant.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray

__all__ = ["WallFunctions", "make_functions"]

_HIGHEST = 12.0
"""Highest degree of all, that of boxes twenty times as long as wide: the rays of a wall
tell no finer ones, and the work grows with the square of their number."""


@dataclass(frozen=True, eq=False)
class WallFunctions:
    """Orthonormal functions on the walls x0, x1, y0, y1, floor, ceiling.

    Parameters
    ----------
    degrees : ndarray, shape (functions, 2)
        Degrees along the two axes that follow the wall's own (x before y before z
        before x).
    starts : ndarray, shape (7,)
        Number of the first function of each wall.
    scale : ndarray, shape (functions,)
        What makes the products of polynomials orthonormal [1/m].
    """

    degrees: NDArray[np.int64]
    starts: NDArray[np.int64]
    scale: FloatArray

    def __len__(self) -> int:
        return len(self.scale)


def make_functions(size: FloatArray, degree: float, stretch: float) -> WallFunctions:
    """Return functions fine enough for a box.

    Along a side that is longer than the box is wide or high, sound spreads step by
    step: the highest degree there is `degree` times the root of that ratio to the
    power `stretch`. Degrees i and j go together while i over the highest along the
    one side and j over that along the other add to one or less.

    Parameters
    ----------
    size : ndarray, shape (3,)
        Lengths of the box [m].
    degree : float
        Highest degree in a cube.
    stretch : float
        Growth with the ratio of lengths.

    Examples
    --------
    >>> len(make_functions(np.array([1.0, 1.0, 1.0]), 1, 0.5))
    18
    """
    degrees, starts, scale = [], [0], []
    for wall in range(6):
        sides = [(wall // 2 + k) % 3 for k in (1, 2)]
        highest = []
        for side in sides:
            across = min(size[k] for k in range(3) if k != side)
            ratio = max(size[side] / across, 1.0)
            wanted = max(np.floor(degree * ratio**stretch + 1e-9), 1.0)
            highest.append(min(wanted, _HIGHEST))
        area = size[sides[0]] * size[sides[1]]
        for i in range(int(highest[0]) + 1):
            for j in range(int(highest[1]) + 1):
                if i / highest[0] + j / highest[1] <= 1 + 1e-9:
                    degrees.append((i, j))
                    scale.append(np.sqrt((2 * i + 1) * (2 * j + 1) / area))
        starts.append(len(degrees))
    return WallFunctions(np.array(degrees), np.array(starts), np.array(scale))
