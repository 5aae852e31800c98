"""One setting of a knob: what it costs and how wrong it is."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["CostPoint", "median_interval"]


@dataclass(frozen=True)
class CostPoint:
    """One setting of a knob, with what it costs and how wrong it is.

    Parameters
    ----------
    setting : str
        The setting, as a person would write it.
    seconds, seconds_low, seconds_high : float
        Median over repeats, and the ends of its 95 % interval [s].
    error, error_low, error_high : float
        The same of the error, in the unit of the curve.
    repeats : int
        How often it was run.
    on_front : bool
        Whether no other setting is both cheaper and better.
    """

    setting: str
    seconds: float
    seconds_low: float
    seconds_high: float
    error: float
    error_low: float
    error_high: float
    repeats: int
    on_front: bool = False


def median_interval(values: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return the median of values and a 95 % interval of it; NaN values are left out.

    References
    ----------
    Conover, Practical Nonparametric Statistics (1999), section 3.2: order
    statistics bound a quantile whatever the distribution. With fewer than six
    values they reach 95 % only as the whole range, which is what is given then.

    Examples
    --------
    >>> median_interval(np.array([3.0, 1.0, 2.0, np.nan]))
    (2.0, 1.0, 3.0)
    """
    kept = np.sort(values[np.isfinite(values)])
    count = len(kept)
    if not count:
        return float("nan"), float("nan"), float("nan")
    low = max(0, int(np.floor((count - 1.96 * np.sqrt(count)) / 2)))
    return float(np.median(kept)), float(kept[low]), float(kept[count - 1 - low])
