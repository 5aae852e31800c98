"""Squared envelopes of bands, cut out of one spectrum at just the rate they need."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.fft import ifft, next_fast_len, rfft

from analysis.decay.curve import envelope_energy
from rir.arrays import FloatArray
from rir.bands import Band, cached_window

__all__ = ["EnvelopeLayout", "band_envelopes", "fast_length", "transform"]

POINTS = 2048
"""A band's envelope has at least as many samples."""


@dataclass(frozen=True)
class EnvelopeLayout:
    """Where the responses of a chunk stand in their transform."""

    rate: float
    lead: int
    length: int

    def envelope_size(self, bins: int) -> int:
        """Return the samples of an envelope of some bins."""
        return fast_length(max(bins, min(2 * bins, POINTS)))


def band_envelopes(
    spectra: NDArray[np.complex64], band: Band, layout: EnvelopeLayout
) -> FloatArray:
    """Return squared envelopes whose sum is the band's energy."""
    first, window = cached_window(band, layout.rate, layout.length)
    size = layout.envelope_size(len(window))
    part = np.zeros((len(spectra), size), dtype=np.complex64)
    bins = slice(first, first + len(window))
    np.multiply(spectra[:, bins], window, out=part[:, : len(window)])
    envelope = np.asarray(ifft(part, overwrite_x=True))
    return envelope_energy(envelope, 2.0 * size / layout.length)


def transform(samples: NDArray[np.float32]) -> NDArray[np.complex64]:
    """Return the spectra of real samples in single precision.

    Its rounding lies 140 dB under the response, where no band is read.
    """
    return np.asarray(rfft(samples, overwrite_x=True), dtype=np.complex64)


def fast_length(count: int) -> int:
    """Return a length from `count` on that transforms fast."""
    length: Any = next_fast_len(count, real=True)
    return int(length)
