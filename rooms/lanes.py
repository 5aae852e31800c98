"""Bands that hold the same sound are computed as one, and all are joined at last."""

from collections.abc import Iterable

import numpy as np

from rir.arrays import FloatArray, IntArray
from rir.bands import join_bands

__all__ = ["FULL", "BandLanes"]

FULL = 8
"""Lanes of a banded grid; see `rooms.kernels.deposit.LANES`."""


class BandLanes:
    """Which bands are one, and how wide a grid of them is.

    Parameters
    ----------
    values : iterable of ndarray, shape (..., bands)
        All that may tell bands apart.
    centers : tuple of float
        Octave centres [Hz].
    padded : bool
        Whether even a single lane is padded to a register.

    Examples
    --------
    >>> walls = np.array([[0.2, 0.2, 0.4], [0.1, 0.1, 0.1]])
    >>> lanes = BandLanes([walls], (250.0, 500.0, 1000.0))
    >>> lanes.of_band, lanes.centers
    ((0, 0, 1), (500.0, 1000.0))
    """

    def __init__(
        self,
        values: Iterable[FloatArray],
        centers: tuple[float, ...],
        padded: bool = False,
    ) -> None:
        lane = np.zeros(len(centers), dtype=int)
        for part in values:
            lane = _refined(lane, part)
        # by their highest bands: what the last one keeps, the last lane keeps
        tops = sorted({int(np.max(np.nonzero(lane == k))) for k in lane})
        number = {int(lane[top]): k for k, top in enumerate(tops)}
        self.tops = np.array(tops)
        self.of_band = tuple(number[int(k)] for k in lane)
        self.bands = centers
        self.width = 1 if len(tops) == 1 and not padded else FULL
        self.centers = tuple(centers[top] for top in tops)

    def __len__(self) -> int:
        return len(self.tops)

    def fit(self, values: FloatArray) -> FloatArray:
        """Return values by lane, (..., width), of values by band, zeros beyond."""
        if self.width == 1:
            return np.ascontiguousarray(values[..., -1:])
        fitted = np.zeros((*values.shape[:-1], FULL))
        fitted[..., : len(self)] = values[..., self.tops]
        return fitted

    def join(self, signals: FloatArray, sample_rate: int) -> FloatArray:
        """Return the sum of filtered signals, shape (lanes, n)."""
        if len(self) == 1:
            return signals[0]
        return join_bands(signals, self.bands, sample_rate, self.of_band)


def _refined(lane: IntArray, values: FloatArray) -> IntArray:
    """Return lanes of bands that were one so far and hold the same values too."""
    flat = values.reshape(-1, values.shape[-1])
    if not np.any(flat != flat[:, :1]):
        return lane
    refined = np.arange(len(lane))
    for band in range(len(lane)):
        for other in range(band):
            alike = lane[band] == lane[other]
            if alike and np.array_equal(flat[:, band], flat[:, other]):
                refined[band] = refined[other]
                break
    return refined
