"""Gaps in a plane: a wall that goes on behind a doorway or between reflectors."""

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray
from rooms.mesh.panels import Panels

__all__ = ["find_gaps"]

_LEVEL = 1e-3
"""Sine of the angle, and share of the size, within which planes are one."""

_FACING = 0.5
"""Share of a panel's width that must go on behind a gap."""


def find_gaps(
    panels: Panels,
    axes: FloatArray,
    center: FloatArray,
    half: FloatArray,
    which: NDArray[np.bool_],
) -> FloatArray:
    """Return the width of the gap behind each end of panels [m].

    Parameters
    ----------
    panels : Panels
        The panels of a mesh.
    axes, center, half : ndarray, shape (P, 2, 3), (P, 3), (P, 2)
        Their rectangles.
    which : ndarray of bool, shape (P,)
        Panels to look at; the others have none.

    Returns
    -------
    ndarray, shape (P, 2, 2, 2)
        By panel, side of the panel, axis, and end; infinite where nothing goes on.
    """
    gaps = np.full((len(panels), 2, 2), np.inf)
    for panel in np.nonzero(which)[0]:
        normal, size = panels.normal[panel], 2 * half[panel]
        level = np.abs((center - center[panel]) @ normal) <= _LEVEL * size.min()
        ahead = panels.normal @ normal
        # faces that look the other way belong to another side of a wall
        ahead = np.where(panels.sided | panels.sided[panel], ahead, np.abs(ahead))
        others = np.nonzero(level & (ahead >= 1 - _LEVEL**2))[0]
        others = others[others != panel]
        place = (center[others] - center[panel]) @ axes[panel].T
        turned = np.abs(np.einsum("ons,as->ona", axes[others], axes[panel]))
        reach = np.einsum("on,ona->oa", half[others], turned)
        for axis in (0, 1):
            across = 1 - axis
            shared = np.minimum(place + reach, half[panel]) - np.maximum(
                place - reach, -half[panel]
            )
            facing = shared[:, across] >= _FACING * size[across]
            for end, outward in ((0, -1.0), (1, 1.0)):
                apart = outward * place[:, axis] - reach[:, axis] - half[panel, axis]
                # wider than either face it is no gap but a distance
                narrow = np.minimum(2 * reach[:, axis], size[axis]) >= apart
                near = apart[facing & narrow & (apart > 0)]
                gaps[panel, axis, end] = near.min(initial=np.inf)
    return np.repeat(gaps[:, None], 2, axis=1)
