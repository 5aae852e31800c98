"""Responses of a data set at one rate, of one length, divided by their level."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from rir.dataset import Dataset
from rir.errors import SignalError

__all__ = ["ScaledResponses", "scaled_responses"]

IN_MEMORY_BYTES = 1_500_000_000
"""Larger sets go to a memory map: a laptop holds this beside a network's training."""
CHUNK_ROWS = 256
"""Rows read at once: a few megabytes, so that reading costs no memory of note."""
NEAREST_DISTANCE_M = 0.1
"""Nearer ends count as so far apart: the size of a driver, where 1/r ends."""
LOUDEST = 1e6
"""Largest level after scaling; its square, summed over rows, fits into float32."""
HIGHEST_RATE_HZ = 1e6
"""Above every converter of audio: more is a mistaken unit."""


@dataclass(frozen=True, eq=False)
class ScaledResponses:
    """Hold responses ready for computing."""

    responses: np.ndarray
    """Shape (rows, n_samples), float32; a memory map when larger than memory."""
    sample_rate: float
    """Hertz."""
    scale: float
    """What the stored responses were divided by."""


def scaled_responses(
    dataset: Dataset,
    *,
    sample_rate: float | None = None,
    duration: float | None = None,
    level_rows: np.ndarray | None = None,
    store: Path | None = None,
) -> ScaledResponses:
    """Read a data set in chunks, resample, crop and scale it.

    Parameters
    ----------
    dataset : Dataset
        Any number of sessions, in memory or on disk.
    sample_rate : float, optional
        Rate wanted, hertz; polyphase resampling with its low-pass, never a stride.
        The data's own by default.
    duration : float, optional
        Length to keep from the emission on, seconds. The data's own by default.
    level_rows : numpy.ndarray, optional
        Rows that set the scale; all by default.
    store : Path, optional
        Folder for a memory map, used when the result exceeds 1.5 GB.

    Raises
    ------
    SignalError
        If a response holds NaN or infinity, or the rate or the duration is no
        sensible number.
    """
    _check_number("sample rate", sample_rate, "Hz", HIGHEST_RATE_HZ)
    _check_number("duration", duration, "s", math.inf)
    rate = float(sample_rate or dataset.sample_rate)
    factor = Fraction(rate / dataset.sample_rate).limit_denominator(4096)
    n_samples = _kept_samples(dataset, rate, factor, duration)
    responses = _storage(len(dataset), n_samples, store)
    for start, block in _chunks(dataset):
        resampled = _resampled(_finite(block, start), factor)[:, :n_samples]
        responses[start : start + len(block)] = resampled
    rows = np.arange(len(dataset)) if level_rows is None else level_rows
    scale = _scale(responses, dataset, rows)
    for start in range(0, len(responses), CHUNK_ROWS):
        responses[start : start + CHUNK_ROWS] /= scale
    return ScaledResponses(responses.astype(np.float32, copy=False), rate, scale)


def _check_number(what: str, asked: float | None, unit: str, most: float) -> None:
    if asked is None:
        return
    if isinstance(asked, bool) or not isinstance(asked, int | float | np.number):
        raise SignalError(f"{what} {asked!r} is not a number of {unit}")
    if not 0 <= asked <= most or asked == math.inf:
        raise SignalError(
            f"{what} {asked:g} {unit} is negative or beyond reason; "
            "leave it out to keep the data's own"
        )


def _kept_samples(
    dataset: Dataset, rate: float, factor: Fraction, duration: float | None
) -> int:
    available = -(-dataset.n_samples * factor.numerator // factor.denominator)
    if duration is None:
        return available
    return max(1, min(available, round(duration * rate)))


def _storage(rows: int, n_samples: int, store: Path | None) -> np.ndarray:
    # Stored responses of 1e-12 or 1e6 must survive until they are scaled.
    if rows * n_samples * 4 <= IN_MEMORY_BYTES or store is None:
        return np.empty((rows, n_samples), dtype=np.float32)
    store.mkdir(parents=True, exist_ok=True)
    return np.lib.format.open_memmap(
        store / "responses.npy", mode="w+", dtype=np.float32, shape=(rows, n_samples)
    )


def _chunks(dataset: Dataset) -> Iterator[tuple[int, np.ndarray]]:
    for start in range(0, len(dataset), CHUNK_ROWS):
        stop = min(start + CHUNK_ROWS, len(dataset))
        yield start, np.asarray(dataset.responses[start:stop], dtype=np.float64)


def _finite(block: np.ndarray, start: int) -> np.ndarray:
    broken = np.flatnonzero(~np.isfinite(block).all(axis=1))
    if len(broken):
        named = ", ".join(str(start + row) for row in broken[:5])
        raise SignalError(
            f"{len(broken)} of rows {start}-{start + len(block) - 1} hold NaN or "
            f"infinity (first: {named}); leave them out with dataset.subset"
        )
    return block


def _resampled(block: np.ndarray, factor: Fraction) -> np.ndarray:
    if factor == 1:
        return block
    from scipy.signal import resample_poly

    # A response is a density in time: keep its transfer function's level.
    up, down = factor.numerator, factor.denominator
    return resample_poly(block, up, down, axis=-1) * (down / up)


def _scale(responses: np.ndarray, dataset: Dataset, rows: np.ndarray) -> float:
    distances = np.linalg.norm(
        dataset.emitters.positions - dataset.listeners.positions, axis=1
    )
    level = np.zeros(len(rows))
    for start in range(0, len(rows), CHUNK_ROWS):
        part = rows[start : start + CHUNK_ROWS]
        peaks = np.abs(responses[part]).max(axis=1).astype(np.float64)
        level[start : start + CHUNK_ROWS] = peaks * np.maximum(
            distances[part], NEAREST_DISTANCE_M
        )
    heard = level[level > 0]
    if not len(heard):
        return 1.0
    # Squares of the loudest row must fit into float32, whatever the others are.
    return float(max(np.median(heard), heard.max() / LOUDEST))
