"""A metric: the difference of centre times, ISO 3382-1:2009, A.2.4."""

import numpy as np
from numpy.typing import NDArray

from analysis.metrics import Flavour, Metric
from analysis.metrics.metric import Features


def describe(samples: NDArray[np.float64], sample_rate: int) -> Features:
    """Return the centre of gravity of the energy, from sample 0 on [s]."""
    time = np.arange(samples.shape[-1]) / sample_rate
    with np.errstate(invalid="ignore"):
        return (np.asarray((samples**2 @ time) / np.sum(samples**2, axis=-1)),)


def compare(truth: Features, prediction: Features) -> NDArray[np.float64]:
    """Return the absolute difference [s]."""
    return np.abs(truth[0] - prediction[0])


CENTRE_TIME = Metric(
    symbol="Ts",
    title="centre time",
    unit="s",
    table_unit="ms",
    table_factor=1000.0,
    decimals=1,
    symmetric=True,
    formula="|T - T'|, T = sum of t h^2 over sum of h^2",
    flavours={"paper": Flavour("paper-1", describe, compare, "ISO 3382-1:2009")},
)
