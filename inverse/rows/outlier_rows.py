"""Hear a room again without the rows that do not belong to it.

One row in twenty under a wrong label bends every wall a little. Once a room is roughly
known such rows stand out; it is then fitted to the others alone.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from inverse.acoustics import Acoustics
from inverse.rows.fitset import FitSet
from inverse.rows.suspect_rows import doubtful_words

__all__ = ["heard_without_strays", "stray_rows"]

TOLD, UNTOLD = 0.005, 0.5
"""Energy a room may leave that is understood so far, but not well."""
ALONE, WORSE, MOST = 0.5, 6.0, 0.15
BETTER = 0.6


def heard_without_strays(
    rows: FitSet, hear: Callable[[FitSet], Acoustics]
) -> Acoustics:
    """Return what is heard in rows, in those that belong together if that is clearer.

    Parameters
    ----------
    rows : FitSet
        Measured rows.
    hear : callable
        Hears a room in rows.
    """
    first = hear(rows)
    if first.fitted is None or not TOLD < first.unexplained < UNTOLD:
        return first
    strays = stray_rows(rows, first)
    if not strays.any():
        return first
    again = hear(rows.rows(np.flatnonzero(~strays)))
    if again.fitted is None or again.unexplained > BETTER * first.unexplained:
        return first
    again.alarms.extend(doubtful_words(rows, strays))
    return again


def stray_rows(rows: FitSet, acoustics: Acoustics) -> NDArray[np.bool_]:
    """Return which rows a roughly known room tells far worse than most, (rows,)."""
    strays = np.zeros(len(rows), dtype=bool)
    if acoustics.fitted is None:
        return strays
    power = (rows.responses**2).sum(axis=1)
    told = acoustics.fitted.predict(rows.emitters, rows.listeners, rows.n_samples)
    left = ((rows.responses - told) ** 2).sum(axis=1)
    share = left / np.maximum(power, 1e-300)
    sounding = power > 1e-12 * max(float(power.max(initial=0.0)), 1e-300)
    strays = sounding & (share > max(ALONE, WORSE * float(np.median(share))))
    return strays if strays.mean() <= MOST else np.zeros(len(rows), dtype=bool)
