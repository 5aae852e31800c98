"""EDT: absolute error of the early decay time."""

import numpy as np

from analysis.metrics.energy_curve import paper_energy_curve, plain_curves
from analysis.metrics.flavours import parameter_flavours
from analysis.metrics.metric import Features, Metric
from rir.arrays import FloatArray

__all__ = ["EARLY_DECAY"]


def paper_early_decay_time(samples: FloatArray, sample_rate: int) -> Features:
    """Return 6 x the time of the sample nearest to -10 dB, from sample 0 [s]."""
    curve = paper_energy_curve(samples)
    return (6.0 * np.argmin(np.abs(curve + 10.0), axis=-1) / sample_rate,)


def raf_early_decay_time(samples: FloatArray, sample_rate: int) -> Features:
    """Return 6 x the time of the first sample below -10 dB; NaN if there is none."""
    below = plain_curves(samples) < -10.0
    first = np.where(below.any(axis=-1), np.argmax(below, axis=-1), np.nan)
    return (6.0 * first / sample_rate,)


EARLY_DECAY = Metric(
    symbol="EDT",
    title="early decay time",
    unit="s",
    table_unit="ms",
    table_factor=1000.0,
    decimals=1,
    symmetric=True,
    formula="|EDT - EDT'|, EDT = 6 x the time from sample 0 to -10 dB",
    flavours=parameter_flavours("EDT", paper_early_decay_time, raf_early_decay_time),
)
