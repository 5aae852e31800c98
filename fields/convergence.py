"""Whether a training had come to rest when its budget ended."""

from collections.abc import Sequence

import numpy as np

__all__ = ["AT_REST", "late_fall"]

AT_REST = 0.05
"""A loss that falls by less than this in the last quarter counts as at rest;
batches scatter by about half of it."""
FEWEST_POINTS = 40
"""Losses needed: a tenth of them, four, is the fewest a mean of scatter is worth."""


def late_fall(history: Sequence[Sequence[float]]) -> float:
    """Return the part by which the loss still fell in the last quarter.

    Compared are the means of the last tenth and of the tenth a quarter earlier.

    Parameters
    ----------
    history : sequence
        Step, seconds and loss, as in the report of a trained field.

    Returns
    -------
    float
        0.1 for a tenth; NaN where fewer than 40 losses were kept.

    Examples
    --------
    >>> steady = [(step, step, 2.0) for step in range(100)]
    >>> falling = [(step, step, 100 - step) for step in range(100)]
    >>> late_fall(steady), round(late_fall(falling), 2)
    (0.0, 0.82)
    """
    losses = np.array([point[2] for point in history], dtype=float)
    losses = losses[np.isfinite(losses)]
    count = len(losses)
    if count < FEWEST_POINTS:
        return float("nan")
    tenth = count // 10
    middle = round(0.7 * count)
    before = losses[middle - tenth // 2 : middle - tenth // 2 + tenth].mean()
    if before == 0:
        return 0.0
    return float(1 - losses[-tenth:].mean() / before)
