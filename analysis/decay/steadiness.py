"""How much the noise swings: what its mean over a stretch is not known to."""

import math

import numpy as np
from numba import njit

from analysis.decay.blocks import median_of
from analysis.decay.model import level_at

__all__ = ["SCALES", "doubt_over", "fill_swings"]

SCALES = 7
"""Stretches of 1, 2, 4, ... 64 blocks are looked at."""
LARGEST = 4.0
"""A block this many times over the median is an event and counts as so many."""


@njit(cache=True, nogil=True)
def fill_swings(means, used_from, count, theta, scale, freedom, variances):
    """Fill the excess variances of the noise's mean over 1, 2, 4, ... blocks.

    `means` are blocks `scale` times as wide as those of `theta`; the decay is taken
    off them, and off the variances what steady noise of `freedom` degrees of freedom
    a block scatters. All is relative to the noise. Returns blocks, scales known, and
    how far the blocks' mean lies off the noise, squared.
    """
    noise = np.exp(theta[0])
    blocks = count - used_from
    rest = np.empty(max(blocks, 0))
    for k in range(blocks):
        decay = level_at(theta, (used_from + k + 0.5) * scale)
        rest[k] = max((means[used_from + k] - decay) / noise, 0.0)
    most, bias = 0.0, 0.0
    if blocks > 0:
        most = LARGEST * max(median_of(rest.copy()), 1.0)
    for k in range(blocks):
        rest[k] = min(rest[k], most)
        bias += rest[k] / blocks
    known, size = 0, 1
    while known < SCALES and blocks // size >= 3:
        groups = blocks // size
        first, second = 0.0, 0.0
        # From the end back: what the decay leaves uncertain comes first.
        for group in range(groups):
            total = 0.0
            for k in range(blocks - (group + 1) * size, blocks - group * size):
                total += rest[k]
            first += total / size
            second += (total / size) ** 2
        variance = (second - first * first / groups) / (groups - 1)
        variances[known] = max(variance - 2.0 / (freedom * size), 0.0)
        known, size = known + 1, size * 2
    return blocks, known, (bias - 1.0) ** 2 if known > 0 else 0.0


def doubt_over(stretch: float, variances: np.ndarray, known: int) -> float:
    """Return the variance of the noise's mean over a stretch [blocks]."""
    if known == 0:
        return 0.0
    place = min(max(math.log2(max(stretch, 1.0)), 0.0), known - 1.0)
    low = int(place)
    high = min(low + 1, known - 1)
    inside = (1.0 - place + low) * variances[low] + (place - low) * variances[high]
    beyond = max(stretch / 2.0 ** (known - 1), 1.0)
    return float(inside) / beyond
