"""A clock that runs off, evaluated exactly."""

from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["evaluate_stretched"]


def evaluate_stretched(
    spectrum: NDArray[np.complex128], n_fft: int, n_samples: int, stretch: float
) -> NDArray[np.float64]:
    """Return a periodic band-limited signal at times that run faster.

    Parameters
    ----------
    spectrum : ndarray, shape (n_fft // 2 + 1,)
        Real-FFT bins of the signal; the last bin is ignored if `n_fft` is even.
    n_fft : int
        Length of the transform.
    n_samples : int
        How many samples to return, at most `n_fft`.
    stretch : float
        Sample m is the signal at time ``(1 + stretch) m``.

    Notes
    -----
    The sum over bins ``y(t) = Σ Y_k exp(2πi k t / N)`` at equally spaced times is a
    chirp-z transform (Bluestein 1970): ``2 k m = k² + m² - (m - k)²`` turns it into
    a convolution. Nothing is interpolated, so the result is exact to rounding.

    Examples
    --------
    >>> x = np.cos(2 * np.pi * 5 * np.arange(64) / 64)
    >>> y = evaluate_stretched(np.fft.rfft(x), 64, 60, 1e-3)
    >>> expected = np.cos(2 * np.pi * 5 * 1.001 * np.arange(60) / 64)
    >>> bool(np.abs(y - expected).max() < 1e-12)
    True
    """
    fft: Any = import_module("scipy.fft")
    bins = (n_fft + 1) // 2
    step = np.pi * (1 + stretch) / n_fft
    wave = np.exp(1j * step * np.arange(max(bins, n_samples), dtype=float) ** 2)
    n = fft.next_fast_len(bins + n_samples - 1)
    left = np.zeros(n, dtype=complex)
    left[:bins] = spectrum[:bins] * wave[:bins]
    left[1:bins] *= 2
    right = np.zeros(n, dtype=complex)
    right[:n_samples] = wave[:n_samples].conj()
    right[n - bins + 1 :] = wave[1:bins][::-1].conj()
    total = fft.ifft(fft.fft(left) * fft.fft(right))[:n_samples]
    return (total * wave[:n_samples]).real / n_fft
