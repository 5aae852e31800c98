"""Parameters of decays freed of noise: how the robust flavours describe responses."""

import numpy as np

from analysis.metrics.metric import Features
from rir.arrays import FloatArray

__all__ = ["noise_freed"]


def noise_freed(symbol: str, samples: FloatArray, sample_rate: int) -> Features:
    """Return a parameter of ISO 3382-1 by its symbol; NaN where it cannot be known."""
    from analysis.parameters import acoustic_parameters

    return (np.asarray(acoustic_parameters(samples, sample_rate)[symbol]),)
