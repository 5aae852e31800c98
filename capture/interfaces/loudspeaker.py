"""What a simulated loudspeaker does to its signal."""

from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["drive", "loudspeaker_gain"]

OVERSAMPLING = 4  # a cube of the full band reaches three times its rate


def drive(
    signal: NDArray[np.float64], harmonics_db: tuple[float, float]
) -> NDArray[np.float64]:
    """Return a signal with second and third harmonics, free of aliases.

    Parameters
    ----------
    signal : ndarray, shape (n,)
        What the loudspeaker is given.
    harmonics_db : tuple of float
        Level of the second and third harmonic of a sine at the signal's peak
        level, relative to the sine [dB].

    Returns
    -------
    ndarray, shape (n,)
        The signal with harmonics up to the band edge of its sample rate.

    Notes
    -----
    For a sine of amplitude A, ``g x² / A`` has a second harmonic of ``g A / 2``
    and ``g x³ / A²`` a third of ``g A / 4``. The powers are formed at four times
    the rate: a square at the signal's own rate would fold back into the band.
    """
    fft: Any = import_module("scipy.fft")

    peak = float(np.abs(signal).max())
    if not peak:
        return signal.copy()
    n = fft.next_fast_len(len(signal) + 4096, real=True)
    spectrum = fft.rfft(signal, n)
    fine = fft.irfft(spectrum, OVERSAMPLING * n) * OVERSAMPLING
    second, third = (10 ** (level / 20) for level in harmonics_db)
    bent = 2 * second * fine**2 / peak + 4 * third * fine**3 / peak**2
    low = fft.rfft(bent)[: len(spectrum)] / OVERSAMPLING
    low[0] = 0.0
    low[-1] = 0.0
    return signal + fft.irfft(low, n)[: len(signal)]


def loudspeaker_gain(frequencies: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Return the gain of a small closed-box loudspeaker at frequencies [Hz].

    A second-order high-pass at 80 Hz (Butterworth) and a first-order roll-off at
    16 kHz: minimum phase, 0 dB at 1 kHz to within 0.02 dB.
    """
    s = 1j * np.maximum(frequencies, 1e-9)
    low, high = 80.0, 16000.0
    high_pass = s**2 / (s**2 + np.sqrt(2) * low * s + low**2)
    return high_pass / (1 + s / high)
