"""From recording and excitation to impulse response."""

from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.target import band_target, occupied_band, usable_band
from rir.errors import SignalError

__all__ = ["Deconvolution", "deconvolve"]

FloatArray = NDArray[np.float64]
REGULARIZATION = 1e-8


@dataclass(frozen=True, eq=False)
class Deconvolution:
    """Responses and what was found on the way to them.

    Attributes
    ----------
    response : ndarray, shape (..., pre + length)
        Sample `pre` is the emission.
    latency : float
        Delay of the loopback [samples]; NaN without one.
    verdicts : tuple
        What the checks say.
    figures : dict
        Every number found.
    """

    response: FloatArray
    sample_rate: float
    pre: int
    latency: float = np.nan
    drift_ppm: float = np.nan
    verdicts: tuple[Any, ...] = ()
    figures: dict[str, Any] = field(default_factory=dict)


def deconvolve(
    recording: FloatArray,
    excitation: FloatArray,
    sample_rate: float,
    *,
    loopback: FloatArray | None = None,
    band: tuple[float, float] | None = None,
    length: int | None = None,
    pre: int = 0,
    golden: FloatArray | None = None,
    direct_delay: FloatArray | None = None,
) -> Deconvolution:
    """Divide a recording by its excitation, or by the loopback if there is one.

    Parameters
    ----------
    recording : ndarray, shape (..., n)
        What the microphones heard.
    excitation : ndarray, shape (m,)
        What was played.
    sample_rate : float
        Rate [Hz].
    loopback : ndarray, shape (n,), optional
        What came back by cable.
    band : tuple of float, optional
        Flat part of the result [Hz].
    length, pre : int
        Samples from the emission on, and before it.
    golden, direct_delay
        For the checks.

    Raises
    ------
    SignalError
        If there is nothing to divide by.
    """
    del golden, direct_delay
    fft: Any = import_module("scipy.fft")
    samples = np.asarray(recording, dtype=float)
    reference = np.asarray(excitation if loopback is None else loopback, dtype=float)
    length = samples.shape[-1] if length is None else length
    n = fft.next_fast_len(samples.shape[-1] + length + pre, real=True)
    spectrum = fft.rfft(reference, n)
    power = np.abs(spectrum) ** 2
    if not power.max():
        raise SignalError("the excitation is silent: nothing to divide by")
    played = np.abs(fft.rfft(np.asarray(excitation), n)) ** 2
    occupied = occupied_band(played, sample_rate)
    flat = usable_band(band, occupied, sample_rate)
    target = band_target(fft.rfftfreq(n, 1 / sample_rate), flat, occupied)
    inverse = target * np.conj(spectrum) / (power + REGULARIZATION * np.median(power))
    result = np.empty((*samples.shape[:-1], pre + length))
    for index in np.ndindex(samples.shape[:-1]):
        whole = fft.irfft(fft.rfft(samples[index], n) * inverse, n)
        result[index][:pre] = whole[n - pre :]
        result[index][pre:] = whole[:length]
    latency = np.nan if loopback is None else _lag(loopback, excitation, n)
    figures = {"latency_samples": latency}
    return Deconvolution(result, sample_rate, pre, latency, figures=figures)


def _lag(loopback: FloatArray, excitation: FloatArray, n: int) -> float:
    fft: Any = import_module("scipy.fft")
    product = fft.rfft(loopback, n) * np.conj(fft.rfft(np.asarray(excitation), n))
    return float(np.argmax(fft.irfft(product, n)))
