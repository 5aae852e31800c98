"""Split sound into octaves and put it together again."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

__all__ = ["band_weights", "join_bands"]

FloatArray = NDArray[np.float64]
_RINGING = 0.04
"""Room behind the samples for what the lowest band's filter rings [s]."""


@lru_cache(maxsize=32)
def band_weights(
    centers: tuple[float, ...], sample_rate: int, length: int
) -> FloatArray:
    """Return the real gain of each band's filter at the bins of a real FFT.

    Neighbours cross over as cos² and sin² of log f, so the gains add to one at
    every frequency: sound whose bands all have gain 1 comes back untouched. The
    outermost bands reach down to 0 Hz and up to the Nyquist frequency.

    Returns
    -------
    ndarray, shape (bands, length // 2 + 1)
    """
    f = np.fft.rfftfreq(length, 1 / sample_rate)
    place = np.interp(
        np.log(np.maximum(f, 1e-3)), np.log(centers), np.arange(len(centers))
    )
    distance = np.abs(place - np.arange(len(centers))[:, None])
    return np.where(distance < 1, np.cos(np.pi / 2 * np.minimum(distance, 1)) ** 2, 0)


def join_bands(
    signals: FloatArray, centers: FloatArray, sample_rate: int
) -> FloatArray:
    """Filter each band's signal, shape (bands, n), and return their sum, shape (n,)."""
    from scipy.fft import irfft, next_fast_len, rfft

    n = signals.shape[-1]
    length = next_fast_len(n + int(_RINGING * sample_rate), real=True)
    weights = band_weights(tuple(map(float, centers)), sample_rate, length)
    spectra = np.asarray(rfft(signals, length, axis=-1))
    return np.asarray(irfft(np.einsum("bf,bf->f", weights, spectra), length))[:n]
