"""Rows that do not belong to a room.

One row in twenty under a wrong label bends every wall a little. Once a room is roughly
known such rows stand out; it is then fitted to the others alone.
"""

import numpy as np
from numpy.typing import NDArray

from inverse.rows.fitset import FitSet

__all__ = ["outlier_rows"]

ALONE, WORSE, MOST = 0.5, 6.0, 0.15
"""An outlier leaves half of its energy and six times what most do; where more than one
row in seven does, it is the room that is not understood."""


def outlier_rows(rows: FitSet, predicted: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which rows a roughly known room explains far worse than most, (rows,).

    Parameters
    ----------
    rows : FitSet
        Measured rows.
    predicted : ndarray, shape (rows, n_samples)
        What the room's paths predict for them.
    """
    power = (rows.responses**2).sum(axis=1)
    error = ((rows.responses - predicted) ** 2).sum(axis=1)
    share = error / np.maximum(power, 1e-300)
    sounding = power > 1e-12 * max(float(power.max(initial=0.0)), 1e-300)
    outliers = sounding & (share > max(ALONE, WORSE * float(np.median(share))))
    return outliers if outliers.mean() <= MOST else np.zeros(len(rows), dtype=bool)
