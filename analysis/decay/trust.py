"""Whether noise that swings, or looks like a second slope, spoils a line's slope."""

import math
from dataclasses import dataclass

import numpy as np

from analysis.decay.model import NOTHING, level_at
from analysis.decay.noise import NoiseFit
from analysis.decay.steadiness import SCALES, doubt_over, fill_swings
from rir.arrays import FloatArray

__all__ = ["Swings", "is_doubtful", "level_error"]

SURE_FALL = 20.0
"""A late decay that falls so many times is one, whatever the noise does."""
SWINGS_ABOVE = 8.0
"""Else it starts at so many standard deviations of the noise's swings."""


@dataclass(frozen=True)
class Swings:
    """Relative variances of the noise's mean over 1, 2, 4, ... blocks of `width`.

    `bias` is the square of how far the noise assumed lies off their mean.
    """

    variances: FloatArray
    known: int
    blocks: int
    width: int
    bias: float

    @classmethod
    def of(cls, fit: NoiseFit, crossing: int) -> "Swings":
        """Return what the blocks behind the crossing [samples] show."""
        variances = np.zeros(SCALES)
        blocks, known, bias = fill_swings(
            fit.wide,
            min(math.ceil(crossing / fit.wide_width), fit.wide_count),
            fit.wide_count,
            fit.theta,
            fit.wide_width / fit.width,
            fit.wide_width * fit.density,
            variances,
        )
        return cls(variances, known, blocks, fit.wide_width, bias)

    @property
    def largest(self) -> float:
        """Standard deviation of single blocks, or longer stretches if those vary."""
        return math.sqrt(float(self.variances.max()))

    def over(self, stretch: int) -> float:
        """Return the error of the noise assumed over a stretch [samples]."""
        own = doubt_over(stretch / self.width, self.variances, self.known)
        whole = doubt_over(self.blocks, self.variances, self.known)
        return math.sqrt(own + whole + self.bias)


def level_error(left: float, stretch: int, noise: float, tail: float, swings: Swings):
    """Return the error of the curve's level by the noise's swings [dB].

    Parameters
    ----------
    left : float
        Energy of the decay from there on.
    stretch : int
        Samples from there to the crossing.
    noise : float
        Mean square of the noise.
    tail : float
        Energy of the decay behind the crossing.
    swings : Swings
        What is known of the noise.
    """
    error = swings.over(stretch) * (noise * stretch + tail) / left
    return -10.0 * math.log10(1.0 - min(error, 0.999))


def is_doubtful(fit: NoiseFit, swings: Swings) -> bool:
    """Return whether a second slope may be the noise's own swing."""
    theta = fit.theta
    if theta[3] == NOTHING:
        return False
    fast, slow = math.exp(theta[2]), math.exp(theta[4])
    knee = max((theta[1] - theta[3]) / (fast - slow), 0.0)
    start = math.exp(theta[3] - slow * knee)
    if theta[0] == NOTHING:
        return start < SURE_FALL * level_at(theta, float(fit.count))
    above = start / math.exp(theta[0])
    return above < min(SWINGS_ABOVE * swings.largest, SURE_FALL)
