"""Noise of a response: before the sound arrives, or after it has decayed."""

from collections.abc import Sequence

import numpy as np

from analysis.likeness.octaves import skirts
from rir.arrays import FloatArray
from rir.onset import find_onset

__all__ = ["lead_band_powers", "quiet_part"]

GUARD_SECONDS = 0.001
"""A band-limited direct sound rings this long before it arrives."""
FEWEST = 32
"""Samples of noise: the level of fewer scatters by more than 1 dB."""


def _lead(samples: FloatArray, sample_rate: int) -> FloatArray:
    """Return the later half of what precedes the direct sound.

    Its earlier half may have been faded in.
    """
    onset = float(find_onset(samples)) / sample_rate
    stop = round((onset - GUARD_SECONDS) * sample_rate)
    lead = samples[max(0, stop) // 2 : max(0, stop)]
    return lead if len(lead) >= FEWEST and np.any(lead) else samples[:0]


def quiet_part(samples: FloatArray, sample_rate: int) -> FloatArray:
    """Return the quieter of lead and last tenth: what is most surely noise.

    A record that ends before its decay has no noise in its tail, and one whose
    emitter stands close has hardly any lead.

    Parameters
    ----------
    samples : ndarray, shape (n,)
        Response.
    sample_rate : int
        Samples per second [Hz].
    """
    tail = samples[-max(16, len(samples) // 10) :]
    lead = _lead(samples, sample_rate)
    # Only a tail that still decays is well above the lead.
    clearly = len(lead) and 2 * np.mean(lead**2) < np.mean(tail**2)
    return lead if clearly else tail


def lead_band_powers(
    samples: FloatArray, sample_rate: int, centers: Sequence[float]
) -> FloatArray:
    """Return the most the noise can be in octaves, by the lead; inf without one.

    Three standard deviations of a short lead's power are added.

    Parameters
    ----------
    samples : ndarray, shape (n,)
        Response.
    sample_rate : int
        Samples per second [Hz].
    centers : sequence of float
        Octaves [Hz].
    """
    from scipy.fft import rfft

    lead = _lead(samples, sample_rate)
    if not len(lead):
        return np.full(len(centers), np.inf)
    window = np.hanning(len(lead) + 2)[1:-1]
    density = np.abs(np.asarray(rfft(lead * window))) ** 2 / np.sum(window**2)
    grid = np.fft.rfftfreq(len(lead), 1 / sample_rate)
    powers = []
    for center in centers:
        f = np.linspace(center / 2, center * 2, 129)
        shaped = np.interp(f, grid, density) * skirts(f, center) ** 2
        power = shaped.mean() * (f[-1] - f[0]) / sample_rate
        freedom = max(0.5, 0.71 * center * len(lead) / sample_rate)
        powers.append(power * (1 + 3 / np.sqrt(freedom)))
    return np.array(powers)
