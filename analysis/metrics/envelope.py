"""Env: mean error of the Hilbert envelope over the envelope's maximum."""

import numpy as np

from analysis.metrics.flavours import waveform_flavours
from analysis.metrics.metric import Features, Metric
from rir.arrays import FloatArray

__all__ = ["ENVELOPE"]


def hilbert_envelope(samples: FloatArray, _rate: int) -> Features:
    """Return the magnitude of the analytic signal of the whole record."""
    from scipy.fft import fft, ifft

    count = samples.shape[-1]
    weights = np.zeros(count)
    weights[0] = 1.0
    weights[1 : (count + 1) // 2] = 2.0
    if count % 2 == 0:
        weights[count // 2] = 1.0
    spectrum = np.asarray(fft(samples, axis=-1)) * weights
    return (np.abs(np.asarray(ifft(spectrum, axis=-1))),)


def compare_envelopes(truth: Features, prediction: Features) -> FloatArray:
    """Average the envelope error relative to the truth's largest envelope."""
    error = np.mean(np.abs(truth[0] - prediction[0]), axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return error / np.max(truth[0], axis=-1)


def compare_envelopes_relatively(truth: Features, prediction: Features) -> FloatArray:
    """Sum the envelope error over the sum of the truth's envelope."""
    error = np.sum(np.abs(truth[0] - prediction[0]), axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(error / np.sum(truth[0], axis=-1))


ENVELOPE = Metric(
    symbol="Env",
    title="envelope",
    unit="1",
    table_unit="%",
    table_factor=100.0,
    decimals=1,
    formula="mean |e - e'| / max e, e = |analytic signal|",
    flavours=waveform_flavours(
        hilbert_envelope,
        compare_envelopes,
        compare_envelopes_relatively,
        "ours: error over the sum of the envelope, whatever the length",
    ),
)
