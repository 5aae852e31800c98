"""Spectral shape of late sound, finer than octaves.

Octaves set how loud late sound is; within them rooms and loudspeakers have a shape of
their own, the same at all places. It is read from the smoothed spectra of measured
rows against their predictions, and put on the even tail by a short filter.
"""

import numpy as np

__all__ = ["colored", "tilt_filter"]

SMOOTHED_HZ = 320.0  # narrower, modes of single pairs show; wider, octaves do as well
TAPS_S = 0.006  # resolves 170 Hz, half of what was smoothed
MOST_NEPER = 0.7  # 6 dB: octaves' levels are right already


def tilt_filter(
    measured: np.ndarray, predicted: np.ndarray, sample_rate: float
) -> np.ndarray:
    """Return the filter that gives answers the measured spectral shape.

    Parameters
    ----------
    measured, predicted : numpy.ndarray
        Responses of the same pairs, shape (rows, n).
    sample_rate : float
        Hertz.

    Returns
    -------
    numpy.ndarray
        Minimum phase, shape (taps,). The gain at each frequency is the one that
        makes the mean relative error of smoothed magnitudes least.
    """
    wanted, found = (_smoothed(one, sample_rate) for one in (measured, predicted))
    known = (wanted > 0).all(axis=1) & (found > 0).all(axis=1)
    if not known.any():
        return np.ones(1)
    ratio = np.sort(wanted[known] / found[known], axis=0)
    share = np.cumsum(1 / ratio, axis=0) / (1 / ratio).sum(axis=0)
    middle = np.argmax(share >= 0.5, axis=0)
    gain = np.log(np.take_along_axis(ratio, middle[None], axis=0)[0])
    return _minimum_phase(np.clip(gain, -MOST_NEPER, MOST_NEPER), sample_rate)


def colored(wave: np.ndarray, taps: np.ndarray) -> np.ndarray:
    """Return waveforms (..., n) through a filter, as long as they were."""
    from scipy.signal import oaconvolve

    if len(taps) == 1:
        return wave * taps[0]
    shaped = taps.reshape((1,) * (wave.ndim - 1) + (-1,))
    return np.asarray(oaconvolve(wave, shaped, axes=-1))[..., : wave.shape[-1]]


def _smoothed(responses: np.ndarray, sample_rate: float) -> np.ndarray:
    from scipy.fft import rfft
    from scipy.ndimage import uniform_filter1d

    size = np.abs(np.asarray(rfft(responses, axis=-1)))
    width = max(round(SMOOTHED_HZ * responses.shape[-1] / sample_rate), 1)
    return uniform_filter1d(size, width, axis=-1, mode="nearest")


def _minimum_phase(log_gain: np.ndarray, sample_rate: float) -> np.ndarray:
    """Return the causal filter of a log gain at the bins of a real spectrum."""
    from scipy.fft import irfft, rfft

    taps = max(round(TAPS_S * sample_rate), 8)
    size = int(2 ** np.ceil(np.log2(8 * taps)))
    bins = np.linspace(0, 1, size // 2 + 1)
    log = np.interp(bins, np.linspace(0, 1, len(log_gain)), log_gain)
    cepstrum = np.asarray(irfft(log, size))
    cepstrum[1 : size // 2] *= 2
    cepstrum[size // 2 + 1 :] = 0
    wave = np.asarray(irfft(np.exp(np.asarray(rfft(cepstrum))), size))[:taps]
    return wave * np.cos(0.5 * np.pi * np.arange(taps) / taps) ** 2
