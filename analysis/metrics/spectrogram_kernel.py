"""Compiled comparison of magnitude spectra: one pass, no temporary arrays."""

import numpy as np
from numba import njit

__all__ = ["spectral_errors"]


@njit(cache=True, fastmath=True)
def spectral_errors(truth, prediction):
    """Return convergence + log + linear error of each row of (rows, bins)."""
    rows, bins = truth.shape
    errors = np.empty(rows)
    for row in range(rows):
        squares = 0.0
        reference = 0.0
        linear = 0.0
        logarithmic = 0.0
        for k in range(bins):
            a = truth[row, k]
            b = prediction[row, k]
            squares += (a - b) * (a - b)
            reference += b * b
            linear += abs(a - b)
            logarithmic += abs(np.log(a / b))
        convergence = np.sqrt(squares / reference) if reference > 0 else np.nan
        errors[row] = convergence + (logarithmic + linear) / bins
    return errors
