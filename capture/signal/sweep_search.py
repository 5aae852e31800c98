"""Find the sweeps in a long recording."""

from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.signal.excitation import Excitation

__all__ = ["find_sweeps"]

Array = NDArray[np.float64]

SHARE = 0.25  # -12 dB: a farther place, not an echo beyond a sweep's length
SMOOTH_S = 0.01  # joins the early reflections to one arrival
MARGIN_S = 0.02  # the direct sound may be weaker than what comes after it


def find_sweeps(recording: Array, excitation: Array, sample_rate: float) -> list[int]:
    """Return where sweeps begin, in samples; always at least one.

    Parameters
    ----------
    recording : ndarray, shape (channels, n)
        The recording; the loudest arrival of any channel counts.
    excitation : ndarray, shape (m,)
        What was played.
    sample_rate : float
        Sampling rate, Hz.

    Notes
    -----
    The recording is compressed by the excitation; arrivals further apart than the
    excitation lasts, and at least a quarter as strong as the strongest, are sweeps.
    A sweep is taken to begin 20 ms before its loudest arrival.
    """
    fft: Any = import_module("scipy.fft")
    n = recording.shape[1]
    grid = Excitation(
        excitation, sample_rate, n, length=max(n - excitation.size, 1), pre=0
    )
    over = grid.reciprocal(grid.spectrum)
    strength = np.zeros(n)
    for row in recording:
        if not np.all(np.isfinite(row)):
            continue
        lags = grid.inverse(grid.transform(row - row.mean()) * over)[:n] ** 2
        peak = lags.max()
        strength += lags / peak if peak else 0
    size = max(round(SMOOTH_S * sample_rate), 1)
    length = fft.next_fast_len(n + size, real=True)
    box = fft.rfft(np.ones(size), length)
    smooth = fft.irfft(fft.rfft(strength, length) * box, length)[:n]
    starts: list[int] = []
    rest = np.sqrt(np.maximum(smooth, 0))
    limit = SHARE * rest.max()
    reach = round(0.9 * excitation.size)
    while rest.max() >= limit > 0:
        at = int(np.argmax(rest))
        starts.append(at)
        rest[max(at - reach, 0) : at + reach] = 0
    margin = round(MARGIN_S * sample_rate)
    return [max(at - size - margin, 0) for at in sorted(starts)] or [0]
