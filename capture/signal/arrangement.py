"""Shapes and number formats of what is handed in."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray
from rir.errors import SignalError

__all__ = ["Arrangement", "arrange", "as_float"]

FEWEST = 64  # samples: shorter arrays are channels by mistake


@dataclass(frozen=True, eq=False)
class Arrangement:
    """A recording as takes of channels."""

    takes: NDArray[Any]
    """The recording; of any real type. Shape (takes, channels, n)."""
    loopbacks: list[FloatArray | None]
    """One per take, shape (n,), float64."""
    shape: tuple[int, ...]
    """Shape of a combined response without its time axis."""
    several: bool
    """Whether takes were handed in."""


def as_float(samples: NDArray[Any]) -> FloatArray:
    """Return samples as float64 with full scale 1, whatever their type.

    Examples
    --------
    >>> as_float(np.array([-32768, 16384], dtype=np.int16)).tolist()
    [-1.0, 0.5]
    """
    samples = np.asarray(samples)
    if np.issubdtype(samples.dtype, np.signedinteger):
        return samples / float(2 ** (8 * samples.dtype.itemsize - 1))
    return np.asarray(samples, dtype=np.float64)


def arrange(recording: NDArray[Any], loopback: NDArray[Any] | None) -> Arrangement:
    """Check shapes and lay a recording out as takes of channels.

    Parameters
    ----------
    recording : ndarray
        Shape (n,), (channels, n), (takes, channels, n) or (..., n).
    loopback : ndarray, optional
        Shape (n,), (1, n), or one row per take.

    Raises
    ------
    SignalError
        If a shape or type cannot be meant, with what was expected.
    """
    recording = np.asarray(recording)
    if not (recording.ndim and np.issubdtype(recording.dtype, np.number)):
        raise SignalError("a recording must be an array of numbers with time last")
    if np.iscomplexobj(recording):
        raise SignalError("a recording must be real; this one is complex")
    n = recording.shape[-1]
    if n < FEWEST or recording.size == 0:
        raise SignalError(
            f"the recording has shape {recording.shape}: {n} samples on its last "
            "axis; time must be last, and there must be at least 64 samples"
        )
    if recording.ndim > 1 and recording.shape[-2] > 4 * n:
        raise SignalError(
            f"the recording has shape {recording.shape}; time must be the last axis: "
            "transpose it"
        )
    several = recording.ndim == 3
    takes = recording if several else recording.reshape(1, -1, n)
    shape = recording.shape[1:-1] if several else recording.shape[:-1]
    return Arrangement(takes, _loopbacks(loopback, len(takes), n), shape, several)


def _loopbacks(
    loopback: NDArray[Any] | None, count: int, n: int
) -> list[FloatArray | None]:
    if loopback is None:
        return [None] * count
    rows = as_float(loopback)
    rows = rows.reshape(-1, rows.shape[-1]) if rows.ndim else rows.reshape(1, 1)
    if len(rows) not in (1, count):
        raise SignalError(
            f"{len(rows)} loopbacks for {count} takes; give one, or one per take"
        )
    if abs(rows.shape[1] - n) > max(n // 10, 1):
        raise SignalError(
            f"the loopback has {rows.shape[1]} samples, the recording {n}; both must "
            "come from the same inputs at the same time"
        )
    fitted = np.zeros((len(rows), n))
    kept = min(n, rows.shape[1])
    fitted[:, :kept] = rows[:, :kept]
    return [fitted[index % len(rows)] for index in range(count)]
