"""T60: relative error of the reverberation time."""

from functools import partial

import numpy as np

from analysis.metrics.energy_curve import paper_energy_curve, plain_curves
from analysis.metrics.flavours import noise_freed
from analysis.metrics.metric import AVR, ISO_3382, RAF, Features, Flavour, Metric
from rir.arrays import FloatArray

__all__ = ["REVERBERATION"]


def _line_time(curve: FloatArray, sample_rate: int) -> float:
    """Return 3 x the time the fitted line takes from -5 to -25 dB [s]."""
    first = int(np.argmin(np.abs(curve + 5.0)))
    last = int(np.argmin(np.abs(curve + 25.0)))
    if last <= first or not np.isfinite(curve[first]):
        return np.nan
    level = curve[first : last + 1]
    time = np.arange(first, last + 1) / sample_rate
    centred = time - time.mean()
    # Not np.dot: its threads cost more than such a short sum.
    slope = np.sum(centred * (level - level.mean())) / np.sum(centred**2)
    return 3.0 * -20.0 / slope if slope else np.nan


def paper_reverberation_time(samples: FloatArray, sample_rate: int) -> Features:
    """Fit a line between the samples nearest to -5 and -25 dB."""
    curves = paper_energy_curve(samples)
    flat = curves.reshape(-1, curves.shape[-1])
    times = np.array([_line_time(curve, sample_rate) for curve in flat])
    return (times.reshape(curves.shape[:-1]),)


def relative_error(truth: Features, prediction: Features) -> FloatArray:
    """Return |truth - prediction| / truth."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.abs(truth[0] - prediction[0]) / truth[0])


def raf_reverberation_time(samples: FloatArray, sample_rate: int) -> Features:
    """Return 6 x the time of 10 dB under -5 dB, high-passed; NaN if not reached."""
    curves = plain_curves(high_passed(samples, sample_rate))
    flat = curves.reshape(-1, curves.shape[-1])
    times = [_ten_decibels(curve) for curve in flat]
    return (6.0 * np.array(times).reshape(curves.shape[:-1]) / sample_rate,)


def high_passed(samples: FloatArray, sample_rate: int) -> FloatArray:
    """Filter by a second-order high-pass at 200 Hz with Q = 1/sqrt(2).

    References
    ----------
    Bristow-Johnson, "Cookbook formulae for audio equalizer biquad filter
    coefficients": the HPF.
    """
    from scipy.signal import lfilter

    turn = 2 * np.pi * 200.0 / sample_rate
    alpha, cosine = np.sin(turn) / np.sqrt(2.0), np.cos(turn)
    forward = np.array([1 + cosine, -2 * (1 + cosine), 1 + cosine]) / 2
    back = np.array([1 + alpha, -2 * cosine, 1 - alpha])
    return np.asarray(lfilter(forward, back, samples, axis=-1))


def _ten_decibels(curve: FloatArray) -> float:
    """Return the samples from the first under -5 dB to 10 dB under that one."""
    if not np.any(curve < -5.0):
        return np.nan
    first = int(np.argmax(curve < -5.0))
    below = curve < curve[first] - 10.0
    return float(np.argmax(below)) - first if below.any() else np.nan


def raf_error(truth: Features, prediction: Features) -> FloatArray:
    """Return the relative error; 1 where either time could not be had."""
    error = relative_error(truth, prediction)
    return np.where(np.isfinite(error), error, 1.0)


REVERBERATION = Metric(
    symbol="T60",
    title="reverberation time",
    unit="1",
    table_unit="%",
    table_factor=100.0,
    decimals=1,
    formula="|T - T'| / T, T = 3 x the fitted line's time from -5 to -25 dB",
    flavours={
        "paper": Flavour("paper-1", paper_reverberation_time, relative_error, AVR),
        "raf": Flavour("raf-1", raf_reverberation_time, raf_error, RAF),
        "robust": Flavour(
            "robust-1", partial(noise_freed, "T20"), relative_error, f"{ISO_3382}: T20"
        ),
    },
)
