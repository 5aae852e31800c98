"""Octave bands as complex envelopes, sampled only as fast as they need."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rir.arrays import ComplexArray, FloatArray

__all__ = ["OctaveEnvelope", "octave_envelopes", "skirts", "usable_octaves"]


@dataclass(frozen=True)
class OctaveEnvelope:
    """One octave of a response, moved to zero frequency."""

    center: float
    """Frequency that became zero [Hz]."""
    values: ComplexArray
    """Complex envelope; |values|^2 is the energy density of the band, and its sum over
    `rate` the band's energy. Shape (..., n)."""
    rate: float
    """Samples per second of the envelope [Hz]."""

    def window(self, start: float, stop: float) -> ComplexArray:
        """Return the part between two times [s]."""
        first, last = round(start * self.rate), round(stop * self.rate)
        return self.values[..., max(0, first) : max(0, last)]


def usable_octaves(sample_rate: int, centers: Sequence[float]) -> list[float]:
    """Return the centres whose upper edge lies under 95 % of the Nyquist rate."""
    return [f for f in centers if f * 2**0.5 < 0.475 * sample_rate]


def octave_envelopes(
    samples: FloatArray, sample_rate: int, centers: Sequence[float]
) -> list[OctaveEnvelope]:
    """Split responses into octaves with power-complementary cosine skirts.

    Parameters
    ----------
    samples : ndarray, shape (..., n)
        Responses.
    sample_rate : int
        Samples per second [Hz].
    centers : sequence of float
        Centres of the octaves [Hz].
    """
    from scipy.fft import ifft, next_fast_len, rfft

    length = samples.shape[-1]
    count = int(next_fast_len(length + sample_rate // 20, real=True) or 0)
    spectrum = np.asarray(rfft(samples, count, axis=-1))
    step = sample_rate / count
    result = []
    for center in centers:
        low, high = center / 2**0.75, center * 2**0.75
        first, last = int(np.ceil(low / step)), int(np.floor(high / step)) + 1
        last = min(last, spectrum.shape[-1])
        own = spectrum[..., first:last] * skirts(np.arange(first, last) * step, center)
        small = int(next_fast_len(2 * (last - first)) or 0)
        middle = round(center / step) - first
        moved = np.zeros((*own.shape[:-1], small), dtype=np.complex128)
        moved[..., : own.shape[-1] - middle] = own[..., middle:]
        moved[..., small - middle :] = own[..., :middle]
        values = np.asarray(ifft(moved, axis=-1), dtype=np.complex128) * (small / count)
        rate = small * step
        result.append(
            OctaveEnvelope(
                (first + middle) * step,
                values[..., : int(np.ceil(length / sample_rate * rate))],
                rate,
            )
        )
    return result


def skirts(frequencies: NDArray[Any], center: float) -> FloatArray:
    """Return a magnitude of 1 inside the octave, 0 half an octave outside."""
    away = np.abs(np.log2(frequencies / center))
    return np.cos(np.pi / 2 * np.clip((away - 0.25) / 0.5, 0, 1))
