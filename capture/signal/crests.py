"""Crests that a channel should have reached and did not: clipping, however smooth."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray

__all__ = ["Crests", "measure_crests"]

BLOCK_S = 0.01  # half a period at 50 Hz: one crest in each
QUIETEST, LOUDEST = 0.3, 0.8  # of the extreme: loud enough to tell, too quiet to clip
FEWEST = 8  # blocks for a quantile
QUANTILE = 0.9  # the worst but for a knock or two
NEAR = 0.75  # of the extreme: a plateau is there, a gap is not


@dataclass(frozen=True, eq=False)
class Crests:
    """How far the predicted wave overshoots the extremes of the recorded one."""

    excess: FloatArray
    """Overshoot over the extreme that it passes; NaN if unknown. Shape (channels,)."""
    sigma: FloatArray
    """Error of the prediction at full level, in the same unit. Shape (channels,)."""
    at: NDArray[np.intp]
    """Sample at which it passes by most. Shape (channels,)."""

    @staticmethod
    def joined(parts: "Sequence[Crests]") -> "Crests":
        """Return several as one."""
        return Crests(
            np.concatenate([part.excess for part in parts]),
            np.concatenate([part.sigma for part in parts]),
            np.concatenate([part.at for part in parts]),
        )


def measure_crests(
    recordings: FloatArray, unexplained: NDArray[np.float32], sample_rate: float
) -> Crests:
    """Compare the extremes of recordings with what the response predicts there.

    A clipped recording never passes its extreme, but the response played through
    the excitation does, since clipping is no filter. How well the prediction fits
    is told by the blocks that are too quiet to be clipped.

    Parameters
    ----------
    recordings : ndarray, shape (channels, n)
        What was recorded, without its mean.
    unexplained : ndarray, shape (channels, n)
        What of it the linear response does not explain.
    sample_rate : float
        Sampling rate, Hz.
    """
    size = max(round(BLOCK_S * sample_rate), 8)
    found = [
        _overshoot(row, rest, size)
        for row, rest in zip(recordings, unexplained, strict=True)
    ]
    excess, sigma, at = zip(*found, strict=True)
    return Crests(np.array(excess), np.array(sigma), np.array(at, dtype=np.intp))


def _overshoot(
    row: FloatArray, rest: NDArray[np.float32], size: int
) -> tuple[float, float, int]:
    top = float(max(row.max(), -row.min()))
    if row.size < size * FEWEST or not top > 0:
        return np.nan, np.nan, 0
    predicted = row - rest
    sigma = _prediction_error(predicted, rest, size, top)
    best, where = -np.inf, 0
    for sign in (1.0, -1.0):
        reached = float((sign * row).max())
        # A gap or a knock is no plateau: there the recording is far from its extreme.
        high = np.flatnonzero(sign * row > NEAR * reached)
        if not high.size:
            continue
        at = int(high[np.argmax(sign * predicted[high])])
        excess = sign * float(predicted[at]) - reached
        if excess > best:
            best, where = excess, at
    return best if np.isfinite(best) else 0.0, sigma, where


def _prediction_error(
    predicted: FloatArray, rest: NDArray[np.float32], size: int, top: float
) -> float:
    """Return the error at full level: noise, and what grows with the level."""
    count = rest.size // size
    error = np.sqrt(np.mean(rest[: count * size].reshape(count, size) ** 2, axis=1))
    waves = predicted[: count * size].reshape(count, size)
    level = np.maximum(waves.max(axis=1), -waves.min(axis=1))
    noise = float(np.median(error))
    safe = (level > QUIETEST * top) & (level < LOUDEST * top)
    if np.count_nonzero(safe) < FEWEST:
        return np.nan
    growing = np.sqrt(np.maximum(error[safe] ** 2 - noise**2, 0)) / level[safe]
    return float(np.hypot(noise, top * np.quantile(growing, QUANTILE)))
