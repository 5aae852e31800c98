"""Flavours that several metrics have in common."""

from collections.abc import Callable
from functools import partial

import numpy as np

from analysis.metrics.metric import AVR, ISO_3382, RAF, RAF_NONE, Features, Flavour
from rir.arrays import FloatArray

__all__ = ["noise_freed", "parameter_flavours", "waveform_flavours"]

Describe = Callable[[FloatArray, int], Features]
Compare = Callable[[Features, Features], FloatArray]


def noise_freed(symbol: str, samples: FloatArray, sample_rate: int) -> Features:
    """Return a parameter of ISO 3382-1 by its symbol; NaN where it cannot be known."""
    from analysis.parameters import acoustic_parameters

    return (np.asarray(acoustic_parameters(samples, sample_rate)[symbol]),)


def absolute_error(truth: Features, prediction: Features) -> FloatArray:
    """Return |truth - prediction|."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(truth[0] - prediction[0]))


def parameter_flavours(
    symbol: str, paper: Describe, raf: Describe
) -> dict[str, Flavour]:
    """Return the flavours of the absolute error of a parameter of ISO 3382-1."""
    robust = partial(noise_freed, symbol)
    return {
        "paper": Flavour("paper-1", paper, absolute_error, AVR),
        "raf": Flavour("raf-1", raf, absolute_error, RAF),
        "robust": Flavour("robust-1", robust, absolute_error, ISO_3382),
    }


def waveform_flavours(
    describe: Describe, paper: Compare, robust: Compare, source: str
) -> dict[str, Flavour]:
    """Return the flavours of a metric of whole responses, which RAF has not."""
    return {
        "paper": Flavour("paper-1", describe, paper, AVR),
        "raf": Flavour("raf-1", describe, paper, RAF_NONE),
        "robust": Flavour("robust-1", describe, robust, source),
    }
