"""C50: absolute error of clarity."""

from functools import partial

import numpy as np

from analysis.metrics.metric import AVR, ISO_3382, RAF, Features, Flavour, Metric
from analysis.metrics.noise_freed import noise_freed
from analysis.metrics.table import METRICS
from rir.arrays import FloatArray

__all__ = ["CLARITY"]


def clarity_from_start(samples: FloatArray, split: int) -> FloatArray:
    """Return 10 lg of the energy before over after the sample `split` [dB]."""
    power = samples**2
    with np.errstate(divide="ignore", invalid="ignore"):
        early = np.sum(power[..., :split], axis=-1)
        return np.asarray(10.0 * np.log10(early / np.sum(power[..., split:], axis=-1)))


def paper_clarity(samples: FloatArray, sample_rate: int) -> Features:
    """Split int(0.05 fs) samples after sample 0, whatever the time of flight."""
    return (clarity_from_start(samples, int(0.05 * sample_rate)),)


def raf_clarity(samples: FloatArray, sample_rate: int) -> Features:
    """Split int(0.05 fs + 1) samples after sample 0."""
    return (clarity_from_start(samples, int(0.05 * sample_rate + 1)),)


def absolute_error(truth: Features, prediction: Features) -> FloatArray:
    """Return |truth - prediction|."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(truth[0] - prediction[0]))


CLARITY = METRICS.add("C50")(
    Metric(
        symbol="C50",
        title="clarity",
        unit="dB",
        table_unit="dB",
        table_factor=1.0,
        decimals=2,
        symmetric=True,
        formula="|C - C'|, C = 10 lg(energy before 50 ms / energy after)",
        flavours={
            "paper": Flavour("paper-1", paper_clarity, absolute_error, AVR),
            "raf": Flavour("raf-1", raf_clarity, absolute_error, RAF),
            "robust": Flavour(
                "robust-1", partial(noise_freed, "C50"), absolute_error, ISO_3382
            ),
        },
    )
)
