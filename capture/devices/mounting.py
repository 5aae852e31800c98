"""Devices mounted on a carrier."""

from collections.abc import Sequence

import numpy as np

from rir import Pose
from rir.pose import rotate

__all__ = ["mounted"]


def mounted(carrier: Pose, offsets: Sequence[tuple[float, float, float]]) -> list[Pose]:
    """Return the poses of devices mounted on a carrier.

    Parameters
    ----------
    carrier : Pose
        Where the carrier stands.
    offsets : sequence of tuple
        Places of the devices in the carrier's own frame [m].

    Examples
    --------
    >>> [pose] = mounted(Pose.at(1, 1, 1, yaw_deg=90), [(0.1, 0.0, 0.0)])
    >>> pose.position.round(6).tolist()
    [1.0, 1.1, 1.0]
    """
    turned = rotate(carrier.orientation, np.array(offsets, dtype=float))
    return [Pose(carrier.position + offset, carrier.orientation) for offset in turned]
