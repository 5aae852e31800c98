"""The slow part of a source's response: high-passes and rumble filters.

A pulse of a few milliseconds cannot hold a 10 Hz high-pass. A small sum of
one-pole smoothings of the rendered sound, forwards and backwards in time, can.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Coloring", "fit_coloring"]

FloatArray = NDArray[np.float64]
TIMES_S = 1e-3 * 2.0 ** np.arange(0, 7)
RIDGE = 1e-5
WORTH = 0.97
"""A coloring must lower the squared error of rows it has not seen by 3 %."""


@dataclass(frozen=True, eq=False)
class Coloring:
    """Hold the factors of the smoothings; forwards first, then backwards."""

    factors: FloatArray
    sample_rate: float

    def added(self, responses: FloatArray) -> FloatArray:
        """Return what the coloring adds to rendered responses."""
        if not self.factors.any():
            return np.zeros_like(responses)
        columns = _smoothed(responses, self.sample_rate)
        return np.tensordot(self.factors, columns, axes=1)

    @classmethod
    def none(cls, sample_rate: float) -> "Coloring":
        """Return the coloring that adds nothing."""
        return cls(np.zeros(2 * len(TIMES_S)), sample_rate)


def fit_coloring(
    truth: FloatArray, rendered: FloatArray, sample_rate: float
) -> Coloring:
    """Fit the coloring that brings rendered responses nearest to true ones."""
    none = Coloring.none(sample_rate)
    if len(truth) < 4 or not rendered.any():
        return none
    columns = _smoothed(rendered, sample_rate)
    gap = truth - rendered
    first, second = slice(0, None, 2), slice(1, None, 2)
    half = _solved(columns[:, first], gap[first])
    left = gap[second] - np.tensordot(half, columns[:, second], axes=1)
    if (left**2).sum() > WORTH * (gap[second] ** 2).sum():
        return none
    return Coloring(_solved(columns, gap), sample_rate)


def _solved(columns: FloatArray, gap: FloatArray) -> FloatArray:
    flat = columns.reshape(len(columns), -1)
    square = flat @ flat.T
    # no smoothing may be large: together they can only take away
    square[np.diag_indices_from(square)] += RIDGE * np.trace(square)
    return np.linalg.solve(square, flat @ gap.ravel()).astype(np.float64)


def _smoothed(responses: FloatArray, sample_rate: float) -> FloatArray:
    from scipy.signal import lfilter

    columns = []
    for flip in (slice(None), slice(None, None, -1)):
        turned = responses[:, flip]
        for time in TIMES_S:
            keep = np.exp(-1 / (time * sample_rate))
            smooth = np.asarray(lfilter([1 - keep], [1, -keep], turned, axis=1))
            columns.append(smooth[:, flip])
    return np.array(columns)
