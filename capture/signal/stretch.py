"""The common time-stretch between two responses: what warmer air does to a room."""

from importlib import import_module
from typing import Any

import numpy as np

from capture.signal.resample import evaluate_stretched
from rir.arrays import FloatArray

__all__ = ["apply_stretch", "estimate_stretch", "low_passed"]

STAGES_HZ = (500.0, 1000.0, 2000.0, 4000.0, 8000.0)
"""Octaves: the last fit is within a period of the next."""
ROUNDS = 3  # near the minimum each round of Gauss-Newton doubles the digits
SETTLED = 1e-8  # 0.01 ppm: 6 µK of air


def apply_stretch(response: FloatArray, stretch: float, shift: float) -> FloatArray:
    """Return a response at other times.

    Parameters
    ----------
    response : ndarray, shape (n,)
        Samples.
    stretch : float
        Sample m of the result is the response at ``(1 + stretch) m + shift``.
    shift : float
        Shift [samples].
    """
    if stretch == 0.0 and shift == 0.0:
        return response.copy()
    fft: Any = import_module("scipy.fft")
    n = len(response)
    n_fft = fft.next_fast_len(2 * n, real=True)
    turns = np.exp(2j * np.pi * shift * fft.rfftfreq(n_fft))
    spectrum = fft.rfft(response, n_fft) * turns
    return evaluate_stretched(spectrum, n_fft, n, stretch)


def estimate_stretch(
    first: FloatArray, second: FloatArray, sample_rate: int
) -> tuple[float, float]:
    """Find the stretch and shift that lay one response over another.

    Parameters
    ----------
    first, second : ndarray, shape (n,)
        Two responses between the same places; sample 0 is the emission.
    sample_rate : int
        Rate [Hz].

    Returns
    -------
    stretch, shift : float
        ``second(t) ≈ first((1 + stretch) t + shift)``; shift in samples.

    Notes
    -----
    Gauss-Newton steps on the waveform difference, with the exact derivatives
    ``t h'(t)`` and ``h'(t)``; low frequencies first, where the phases cannot be
    mistaken by a period.
    """
    stretch = shift = 0.0
    for top in STAGES_HZ:
        if top > 0.45 * sample_rate:
            break
        low = low_passed(first, top, sample_rate)
        target = low_passed(second, top, sample_rate)
        for _ in range(ROUNDS):
            step = _step(apply_stretch(low, stretch, shift), target)
            stretch, shift = stretch + step[0], shift + step[1]
            if abs(step[0]) < SETTLED and abs(step[1]) < SETTLED * len(first):
                break
    return stretch, shift


def _step(moved: FloatArray, target: FloatArray) -> tuple[float, float]:
    slope = np.gradient(moved)
    basis = np.stack((slope * np.arange(len(moved)), slope, moved), axis=1)
    solution = np.linalg.lstsq(basis, target - moved, rcond=None)[0]
    return float(solution[0]), float(solution[1])


def low_passed(response: FloatArray, top: float, sample_rate: int) -> FloatArray:
    """Return a response below a frequency [Hz], in zero phase."""
    fft: Any = import_module("scipy.fft")
    n = fft.next_fast_len(2 * len(response), real=True)
    frequencies = fft.rfftfreq(n, 1 / sample_rate)
    fall = np.clip((1.4 * top - frequencies) / (0.4 * top), 0, 1)
    spectrum = fft.rfft(response, n) * np.sin(np.pi / 2 * fall) ** 2
    return fft.irfft(spectrum, n)[: len(response)]
