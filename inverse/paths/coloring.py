"""The slow part of a source's response: high-passes and rumble filters.

A pulse of a few milliseconds cannot hold a 10 Hz high-pass. A small sum of
one-pole smoothings of the rendered sound, forwards and backwards in time, can. What
runs backwards begins after the end of a row: paths are rendered a little further.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rir.arrays import FloatArray

__all__ = ["Coloring", "fit_coloring"]

Render = Callable[[int], FloatArray]
"""Answers the sound of all rows at a number of samples."""
TIMES_S = 1e-3 * 2.0 ** np.arange(0, 7)
AHEAD_S = 0.02  # seconds beyond the end of a row that are rendered for the smoothings
WEAK = 0.1  # weaker factors have nothing to fetch from there
RIDGE = 1e-7
"""Of the trace: -70 dB, above rounding of fourteen columns that are much alike."""
WORTH = 0.97  # a coloring must lower the squared error of rows it has not seen by 3 %


@dataclass(frozen=True, eq=False)
class Coloring:
    """Hold the factors of the smoothings; forwards first, then backwards."""

    factors: FloatArray
    sample_rate: float

    def heard(self, render: Render, n_samples: int) -> FloatArray:
        """Return rendered sound with its coloring, shape (rows, n_samples)."""
        if not self.factors.any():
            return render(n_samples)
        plain = render(n_samples + self.ahead)
        columns = _smoothed(plain, self.sample_rate)
        return (plain + np.tensordot(self.factors, columns, axes=1))[:, :n_samples]

    def added(self, render: Render, n_samples: int) -> FloatArray:
        """Return what the coloring adds to what `render` gives, (rows, n_samples)."""
        if not self.factors.any():
            return np.zeros((1, n_samples))
        columns = _smoothed(render(n_samples + self.ahead), self.sample_rate)
        return np.tensordot(self.factors, columns[..., :n_samples], axes=1)

    @property
    def ahead(self) -> int:
        """Samples beyond the end of a row that are rendered for the smoothings."""
        strong = np.abs(self.factors).max() > WEAK
        return round(AHEAD_S * self.sample_rate) if strong else 0

    @classmethod
    def none(cls, sample_rate: float) -> "Coloring":
        """Return the coloring that adds nothing."""
        return cls(np.zeros(2 * len(TIMES_S)), sample_rate)


def fit_coloring(truth: FloatArray, render: Render, sample_rate: float) -> Coloring:
    """Fit the coloring that brings rendered responses nearest to true ones."""
    none = Coloring.none(sample_rate)
    n_samples = truth.shape[1]
    rendered = render(n_samples)
    if len(truth) < 4 or not rendered.any():
        return none
    gap = truth - rendered
    columns = _smoothed(rendered, sample_rate)
    first, second = slice(0, None, 2), slice(1, None, 2)
    half = _solved(columns[:, first], gap[first])
    left = gap[second] - np.tensordot(half, columns[:, second], axes=1)
    if (left**2).sum() > WORTH * (gap[second] ** 2).sum():
        return none
    near = Coloring(_solved(columns, gap), sample_rate)
    if not near.ahead:
        return near
    columns = _smoothed(render(n_samples + near.ahead), sample_rate)[..., :n_samples]
    return Coloring(_solved(columns, gap), sample_rate)


def _solved(columns: FloatArray, gap: FloatArray) -> FloatArray:
    flat = columns.reshape(len(columns), -1)
    square = flat @ flat.T
    # many smoothings are alike: none may grow large against another
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
