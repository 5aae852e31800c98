"""EDT: absolute error of the early decay time."""

from functools import partial

import numpy as np

from analysis.metrics.clarity import absolute_error
from analysis.metrics.energy_curve import paper_energy_curve, plain_curves
from analysis.metrics.metric import AVR, ISO_3382, RAF, Features, Flavour, Metric
from analysis.metrics.noise_freed import noise_freed
from analysis.metrics.table import METRICS
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


EARLY_DECAY = METRICS.add("EDT")(
    Metric(
        symbol="EDT",
        title="early decay time",
        unit="s",
        table_unit="ms",
        table_factor=1000.0,
        decimals=1,
        symmetric=True,
        formula="|EDT - EDT'|, EDT = 6 x the time from sample 0 to -10 dB",
        flavours={
            "paper": Flavour("paper-1", paper_early_decay_time, absolute_error, AVR),
            "raf": Flavour("raf-1", raf_early_decay_time, absolute_error, RAF),
            "robust": Flavour(
                "robust-1", partial(noise_freed, "EDT"), absolute_error, ISO_3382
            ),
        },
    )
)
