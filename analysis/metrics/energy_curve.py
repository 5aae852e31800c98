"""The energy decay curve of the paper's code family, absolute floor and all."""

import numpy as np

from rir.arrays import FloatArray
from rir.decay import remaining_energy

__all__ = ["PAPER_FLOOR", "paper_energy_curve", "plain_curves"]

PAPER_FLOOR = 1e-9
"""Added to every squared sample: an absolute floor at -90 dB re 1 per sample."""


def paper_energy_curve(samples: FloatArray) -> FloatArray:
    """Return 10 lg of the reversed running sum of h^2 + 1e-9, re its start [dB].

    References
    ----------
    Schroeder, JASA 37 (1965) 409, equation (5), with the floor of the paper's code.
    """
    level = 10.0 * np.log10(remaining_energy(samples**2 + PAPER_FLOOR))
    return level - level[..., :1]


def plain_curves(samples: FloatArray) -> FloatArray:
    """Return 10 lg of the reversed running sum of h^2, re its start [dB].

    NaN after the last sample that is not zero, and for silence.
    """
    energy = remaining_energy(samples**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        level = 10.0 * np.log10(energy)
        curve = level - level[..., :1]
    return np.where(energy > 0, curve, np.nan)
