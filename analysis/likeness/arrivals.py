"""Arrivals that stand alone in a response, and what is left without them."""

from dataclasses import dataclass

import numpy as np

from rir.arrays import FloatArray

__all__ = ["Arrival", "split_arrivals"]

PROMINENCE = 20.0
"""Power over that around it; noise of one power never reaches this."""
HALF_SECONDS = 0.0002
"""Half the window of an arrival [s]: holds a pulse, parts paths 7 cm apart."""
AROUND_SECONDS = 0.002
"""What is around reaches ten times as far to either side [s]."""


@dataclass(frozen=True)
class Arrival:
    """One arrival, cut out with soft edges."""

    start: int
    """Index of its first sample in the response."""
    middle: int
    """Index of its largest sample in the response."""
    samples: FloatArray
    """Shape (k,)."""


def split_arrivals(
    samples: FloatArray, sample_rate: int
) -> tuple[list[Arrival], FloatArray]:
    """Return arrivals that stand alone, and the rest; together they are the response.

    Parameters
    ----------
    samples : ndarray, shape (n,)
        Response.
    sample_rate : int
        Samples per second [Hz].

    Examples
    --------
    >>> pulse = np.zeros(1000)
    >>> pulse[100] = 1.0
    >>> arrivals, rest = split_arrivals(pulse, 16000)
    >>> [a.middle for a in arrivals], float(abs(rest).max())
    ([100], 0.0)
    """
    half = max(2, round(HALF_SECONDS * sample_rate))
    away = np.abs(np.linspace(-1, 1, 2 * half + 1))
    taper = np.where(away < 0.5, 1.0, np.cos(np.pi * (away - 0.5)) ** 2)
    rest, arrivals = samples.copy(), []
    for middle in _middles(samples, half, round(AROUND_SECONDS * sample_rate)):
        low, high = max(0, middle - half), min(len(samples), middle + half + 1)
        first = low - (middle - half)
        own = rest[low:high] * taper[first : first + high - low]
        rest[low:high] -= own
        arrivals.append(Arrival(low, middle, own))
    return arrivals, rest


def _middles(samples: FloatArray, half: int, around: int) -> list[int]:
    """Return where the envelope rises far above what is around, in order of time."""
    from scipy.signal import hilbert

    power = np.abs(np.asarray(hilbert(samples))) ** 2
    index, running = np.arange(len(power)), np.concatenate([[0], np.cumsum(power)])

    def within(reach: int) -> tuple[FloatArray, FloatArray]:
        low = np.maximum(index - reach, 0)
        high = np.minimum(index + reach + 1, len(power))
        return running[high] - running[low], high - low

    (wide, many), (own, few) = within(around), within(half)
    background = (wide - own) / np.maximum(many - few, 1)
    inner = power[1:-1]
    peak = np.zeros(len(power), dtype=bool)
    peak[1:-1] = (inner > power[:-2]) & (inner >= power[2:])
    found = np.flatnonzero(peak & (power > PROMINENCE * background))
    chosen: list[int] = []
    for k in found[np.argsort(-power[found], kind="stable")]:
        if all(abs(k - other) > half for other in chosen):
            chosen.append(int(k))
    return sorted(chosen)
