"""An offset that drifts through the response: found as a polynomial and taken off."""

import numpy as np
from numba import njit

from analysis.decay.model import FAST
from analysis.decay.scan import sum_of
from rir.arrays import FloatArray

__all__ = ["drift_of", "may_drift"]

PARTS = 64
"""Blocks that the drift is fitted to."""
DEGREES = (1, 2, 3)
"""Degrees of the polynomials that are tried, the lowest that fits is taken."""
MOST_LEFT = 4.0
"""Squares of block means left over, times what white noise leaves."""
LEAST_SHARE = 0.3
"""Drift is taken off from this power re the noise on."""


@njit(cache=True, nogil=True, fastmath=FAST)
def power_of(samples, start, stop):
    """Return the sum of squares of a stretch."""
    total = 0.0
    for n in range(start, stop):
        total += samples[n] * samples[n]
    return total


@njit(cache=True, nogil=True)
def may_drift(samples):
    """Return whether the means of the last quarter's parts exceed white noise's."""
    start, parts = (3 * len(samples)) // 4, 16
    width = (len(samples) - start) // parts
    if width < 16:
        return False
    means, power = 0.0, 0.0
    for part in range(parts):
        first = start + part * width
        means += (sum_of(samples, first, first + width) / width) ** 2
        power += power_of(samples, first, first + width) / width
    return means * width > 16.0 * power


@njit(cache=True, nogil=True)
def fill_parts(samples, width, means, variances):
    """Fill means and variances of equal blocks."""
    for part in range(len(means)):
        first = part * width
        mean = sum_of(samples, first, first + width) / width
        total = 0.0
        for n in range(first, first + width):
            total += (samples[n] - mean) ** 2
        means[part] = mean
        variances[part] = total / (width - 1)


def drift_of(samples: FloatArray) -> FloatArray | None:
    """Return the drift of a response, or None if it has none.

    A polynomial is fitted to block means, each weighed by its own scatter, so that
    the decay counts little. It is a drift only if what it leaves in the later half
    scatters like noise: a decay of one sign is no drift.
    """
    width = len(samples) // PARTS
    if width < 16:
        return None
    scale = float(np.max(np.abs(samples)))
    means, variances = np.empty((2, PARTS))
    fill_parts(samples / scale, width, means, variances)
    variances += 1e-30
    time = (np.arange(PARTS) + 0.5) / PARTS
    late = slice(PARTS // 2, None)
    for degree in DEGREES:
        factors = np.polynomial.polynomial.polyfit(
            time, means, degree, w=1.0 / np.sqrt(variances)
        )
        fitted = np.polynomial.polynomial.polyval(time, factors)
        left = (means - fitted)[late] ** 2 * width / variances[late]
        if np.mean(left) <= MOST_LEFT and np.median(variances[late]) > 1e-24:
            power = np.mean(fitted[late] ** 2 / variances[late])
            if power < LEAST_SHARE:
                return None
            moments = (np.arange(len(samples)) + 0.5) / (PARTS * width)
            drift = scale * np.polynomial.polynomial.polyval(moments, factors)
            return np.asarray(drift, dtype=np.float64)
    return None
