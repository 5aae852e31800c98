"""Compiled comparison of magnitude spectra: one pass, no temporary arrays."""

import numpy as np
from numba import njit

__all__ = ["spectral_error_matrix", "spectral_errors"]


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


@njit(cache=True, fastmath=True)
def spectral_error_matrix(spectra):
    """Return `spectral_errors` of all ordered pairs of rows of (rows, bins).

    Bins go through in tiles, so that all rows of a tile stay in the cache.
    """
    rows, bins = spectra.shape
    squares = np.zeros((rows, rows))
    averages = np.zeros((rows, rows))
    reference = np.zeros(rows)
    tile = 2048
    logs = np.empty((rows, tile))
    for start in range(0, bins, tile):
        count = min(tile, bins - start)
        for i in range(rows):
            for k in range(count):
                value = spectra[i, start + k]
                logs[i, k] = np.log(value)
                reference[i] += value * value
        for i in range(rows):
            for j in range(i + 1, rows):
                square = 0.0
                average = 0.0
                for k in range(count):
                    step = spectra[i, start + k] - spectra[j, start + k]
                    square += step * step
                    average += abs(step) + abs(logs[i, k] - logs[j, k])
                squares[i, j] += square
                averages[i, j] += average
    errors = np.zeros((rows, rows))
    for i in range(rows):
        for j in range(i + 1, rows):
            distance = np.sqrt(squares[i, j])
            average = averages[i, j] / bins
            errors[i, j] = average + distance / np.sqrt(reference[j])
            errors[j, i] = average + distance / np.sqrt(reference[i])
    return errors
