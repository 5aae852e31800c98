"""An impulse response and its time axis."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rir.arrays import FloatArray
from rir.errors import SignalError
from rir.numbers import read_number

__all__ = ["ImpulseResponse", "as_samples", "check_sample_rate"]


def check_sample_rate(sample_rate: float) -> int:
    """Return the sample rate as a positive whole number [Hz].

    Raises
    ------
    SignalError
        If it is not one.
    """
    rate = read_number(sample_rate, "sample rate [Hz]")
    if not np.isfinite(rate) or rate <= 0 or rate != round(rate):
        raise SignalError(f"sample rate must be a positive whole Hz, not {sample_rate}")
    return int(rate)


@dataclass(frozen=True, eq=False)
class ImpulseResponse:
    """Sound pressure at a listener per unit sent to an emitter.

    Parameters
    ----------
    samples : array_like, shape (..., n_samples)
        Response; time on the last axis, sample 0 is the instant of emission.
        Levels are kept: nothing is ever normalised to its peak.
    sample_rate : int
        Samples per second [Hz].

    Raises
    ------
    SignalError
        If there is no sample, or the rate is not a positive whole number.

    Examples
    --------
    >>> ImpulseResponse(np.eye(1, 480), 48000).duration
    0.01
    """

    samples: FloatArray
    sample_rate: int

    def __post_init__(self) -> None:
        samples = np.asarray(self.samples, dtype=np.float64)
        if samples.ndim == 0 or samples.shape[-1] == 0:
            raise SignalError(
                f"an impulse response needs samples; got shape {samples.shape}"
            )
        object.__setattr__(self, "samples", samples)
        object.__setattr__(self, "sample_rate", check_sample_rate(self.sample_rate))

    @property
    def n_samples(self) -> int:
        """Number of samples."""
        return self.samples.shape[-1]

    @property
    def duration(self) -> float:
        """Length [s]."""
        return self.n_samples / self.sample_rate

    @property
    def times(self) -> FloatArray:
        """Time of each sample since emission [s], shape (n_samples,)."""
        return np.arange(self.n_samples) / self.sample_rate

    @property
    def energy(self) -> FloatArray:
        """Sum of squares, shape (...)."""
        return np.sum(self.samples**2, axis=-1)

    def resampled(self, sample_rate: int) -> "ImpulseResponse":
        """Return the response at another rate, band-limited, levels kept.

        Levels are kept as a system: the response of the same filter at the new
        rate, so that convolving audio gives the same sound.
        """
        from math import gcd

        from scipy.signal import firwin, resample_poly

        rate = check_sample_rate(sample_rate)
        if rate == self.sample_rate:
            return self
        common = gcd(rate, self.sample_rate)
        up, down = rate // common, self.sample_rate // common
        # Flat to 0.9 of the lower Nyquist frequency, -100 dB from there on.
        steps = max(up, down)
        window: Any = ("kaiser", 10.0)
        taps = firwin(2 * 64 * steps + 1, 0.95 / steps, window=window)
        samples = resample_poly(self.samples, up, down, axis=-1, window=taps)
        samples *= down / up
        return ImpulseResponse(samples, rate)


def as_samples(samples: ArrayLike) -> FloatArray:
    """Return samples as float64; integers are scaled by their full scale."""
    array = np.asarray(samples)
    if np.issubdtype(array.dtype, np.signedinteger):
        return array.astype(np.float64) / float(np.iinfo(array.dtype).max + 1)
    return array.astype(np.float64)
