"""C50: absolute error of clarity."""

import numpy as np

from analysis.metrics.flavours import parameter_flavours
from analysis.metrics.metric import Features, Metric
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


CLARITY = Metric(
    symbol="C50",
    title="clarity",
    unit="dB",
    table_unit="dB",
    symmetric=True,
    formula="|C - C'|, C = 10 lg(energy before 50 ms / energy after)",
    flavours=parameter_flavours("C50", paper_clarity, raf_clarity),
)
