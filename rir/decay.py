"""The energy decay curve and straight lines on it, free of noise.

Recorded responses need their noise found first: `analysis.decay` fits decay and noise
together (maximum likelihood on blocks of samples), `capture.checks.noise_floor` zooms
in on where they cross, octave by octave. Both work on blocks, not on this curve.
"""

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray

__all__ = ["FIT_RANGES_DB", "fit_line", "remaining_energy"]

FIT_RANGES_DB = {"EDT": (0.0, -10.0), "T20": (-5.0, -25.0), "T30": (-5.0, -35.0)}
"""Levels between which each time's line is fitted (ISO 3382-1:2009, 3.2, A.2.2)."""


def remaining_energy(energy: FloatArray, axis: int = -1) -> FloatArray:
    """Return the energy from each moment on, the integral backwards in time.

    References
    ----------
    Schroeder, JASA 37 (1965) 409, equation (5).
    """
    return np.flip(np.cumsum(np.flip(energy, axis), axis), axis)


def fit_line(
    times: FloatArray, levels: FloatArray, upper: float, lower: float
) -> tuple[float, NDArray[np.intp]]:
    """Fit a line to the part of a curve between two levels, by least squares.

    Returns
    -------
    slope : float
        Decibels per unit of time; NaN where fewer than three points lie between, or
        all at one time.
    inside : ndarray of int
        The points used.
    """
    inside = np.flatnonzero((levels <= upper) & (levels >= lower))
    # two points lie on a line whatever the decay
    if len(inside) < 3 or not np.ptp(times[inside]):
        return np.nan, inside
    return np.polyfit(times[inside], levels[inside], 1)[0], inside
