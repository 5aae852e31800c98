"""Rows that fit far worse than all others: swapped labels, wrong poses."""

import numpy as np
from numpy.typing import NDArray

from inverse.rows.fitset import FitSet

__all__ = ["suspect_alarms", "suspect_rows"]

FAR_WORSE = 20.0
"""Times the median of what rows leave: rows shadowed by things leave a few times."""
LEAST_SHARE = 0.3
"""Of its own energy that a suspect row leaves: a swapped label leaves more than all."""
GOOD = 0.1
"""Median above which the room is not understood, so that no row can be blamed."""
MOST = 0.1  # of rows that may be named; more, and it is the room
NAMED = 6  # rows named in an alarm, which one line holds


def suspect_rows(rows: FitSet, predicted: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which rows are predicted far worse than most, shape (rows,).

    None where most rows are predicted badly, or where more than a tenth would be named:
    then it is the room that is not understood.
    """
    power = np.maximum((rows.responses**2).sum(axis=1), 1e-300)
    share = ((rows.responses - predicted) ** 2).sum(axis=1) / power
    middle = float(np.median(share)) if len(share) else 1.0
    worse = (share > FAR_WORSE * middle) & (share > LEAST_SHARE)
    if middle > GOOD or worse.mean() > MOST:
        return np.zeros(len(share), dtype=bool)
    return worse


def suspect_alarms(rows: FitSet, suspect: NDArray[np.bool_]) -> list[str]:
    """Return an alarm that names rows that do not fit by their ends."""
    found = np.flatnonzero(suspect)
    if not len(found):
        return []
    named = ", ".join(
        f"{_place(rows.emitters.positions[k])}-{_place(rows.listeners.positions[k])}"
        for k in found[:NAMED]
    )
    return [
        f"{len(found)} of {len(suspect)} responses do not fit where the others do and "
        f"are not believed; check their labels and poses (emitter-listener, m): {named}"
    ]


def _place(position: NDArray[np.float64]) -> str:
    return "(" + " ".join(f"{one:.2f}" for one in position) + ")"
