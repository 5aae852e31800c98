"""Amp: mean relative error of the smoothed magnitude spectrum."""

import numpy as np

from analysis.metrics.flavours import waveform_flavours
from analysis.metrics.metric import Features, Metric
from rir.arrays import FloatArray

__all__ = ["AMPLITUDE"]

SMOOTHING_BINS = 32
"""As in the evaluation of AVR, which the paper's tables rest on."""


def smooth_spectrum(samples: FloatArray, _rate: int) -> Features:
    """Sum the two-sided magnitude spectrum over 32 bins, edges mirrored."""
    from scipy.fft import fft
    from scipy.ndimage import convolve1d

    magnitude = np.abs(np.asarray(fft(samples, axis=-1)))
    return (convolve1d(magnitude, np.ones(SMOOTHING_BINS), axis=-1, mode="reflect"),)


def compare_spectra(truth: Features, prediction: Features) -> FloatArray:
    """Average |S - S'| / S over the bins."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.mean(np.abs(truth[0] - prediction[0]) / truth[0], axis=-1)


def compare_spectra_relatively(truth: Features, prediction: Features) -> FloatArray:
    """Average |S - S'| / S with S not under a thousandth of its mean."""
    floor = 1e-3 * np.mean(truth[0], axis=-1, keepdims=True)
    error = np.abs(truth[0] - prediction[0])
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.mean(error / np.maximum(truth[0], floor), axis=-1))


AMPLITUDE = Metric(
    symbol="Amp",
    title="amplitude spectrum",
    unit="1",
    formula="mean over bins of |S - S'| / S, S = 32-bin sums of |FFT|",
    flavours=waveform_flavours(
        smooth_spectrum,
        compare_spectra,
        compare_spectra_relatively,
        "ours: as paper-1 with a floor 60 dB under the mean",
    ),
)
