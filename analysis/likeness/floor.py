"""How close two directions could come, given what the session can hold still."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from analysis.likeness.bandwise import noise_density
from analysis.likeness.displacement import displaced
from analysis.likeness.fit import resampled_at
from analysis.likeness.retake import retaken, steady_part
from analysis.metrics import METRICS
from rir.arrays import FloatArray
from rir.physics import STRETCH_PER_KELVIN

__all__ = ["predicted_floor", "worsened"]

EMPTY = 1e-3
"""Power of a band over the largest, under which it counts as an empty end."""
GATE_HZ = 30.0
"""Smoothing of the gate, standard deviation [Hz]: it rings for some 5 ms only."""
LEVEL_DEVIATIONS = 4.0
"""Levels within so many standard deviations count as equal: all but 1 of 16,000."""
FEWEST_DRAWS = 20
"""Comparisons that the mean floor rests on at least."""


def worsened(
    forward: FloatArray,
    reverse: FloatArray,
    sample_rate: int,
    rng: np.random.Generator,
    *,
    temperature_change: float = 0.0,
    position_m: float = 0.0,
) -> FloatArray:
    """Return the forward response as a perfect reverse take would have shown it.

    Parameters
    ----------
    forward, reverse : ndarray, shape (n,)
        Both directions; the quiet part of the reverse one gives the noise.
    sample_rate : int
        Samples per second [Hz].
    rng : numpy.random.Generator
        Draws noise and displacements.
    temperature_change : float
        Warming between the takes [K].
    position_m : float
        Standard deviation of one visit to a place along each axis [m].
    """
    moved, own = forward, steady_part(forward, sample_rate)
    if position_m > 0:
        change = displaced(forward, sample_rate, rng, position_m) - forward
        moved = forward + _in_band(change, forward, own, sample_rate)
    if temperature_change:
        time = np.arange(len(moved)) * (1 + STRETCH_PER_KELVIN * temperature_change)
        change = resampled_at(moved, time) - moved
        moved = moved + _in_band(change, moved, own, sample_rate)
    other = _other_noise(own, steady_part(reverse, sample_rate))
    return retaken(moved, own, other, sample_rate, rng)


def _other_noise(own: FloatArray, other: FloatArray) -> FloatArray:
    """Return the noise of the other take, at the level of the own one if it is equal.

    Levels of short quiet parts scatter; a T60 without correction for noise would tell
    that scatter apart.
    """
    powers = [float(np.mean(part**2)) for part in (own, other)]
    if min(powers) <= 0:
        return other
    scatter = np.sqrt(2 / len(own) + 2 / len(other))
    alike = abs(np.log(powers[0] / powers[1])) < LEVEL_DEVIATIONS * scatter
    return other * np.sqrt(powers[0] / powers[1]) if alike else other


def _in_band(
    change: FloatArray, samples: FloatArray, quiet: FloatArray, sample_rate: int
) -> FloatArray:
    """Return a change with no more power than what it changes can give.

    Interpolation and cutting errors would otherwise fill the empty ends of the band;
    the loudspeaker that empties them acts on every displaced response alike.
    """
    from scipy.fft import irfft, rfft
    from scipy.ndimage import gaussian_filter1d, uniform_filter1d

    changed = np.asarray(rfft(change))
    powers = np.abs(np.stack([np.asarray(rfft(samples)), changed])) ** 2
    power, own = np.asarray(uniform_filter1d(powers, 33, axis=-1, mode="nearest"))
    floor = noise_density(quiet, len(power)) * len(samples)
    # Two waveforms that have nothing in common differ by twice the power of each;
    # single lines of a loud spectrum scatter about that, and limits there would ring.
    times = np.where(power > EMPTY * power.max(), 16.0, 1.5)
    most = times * np.maximum(power - floor, 0.0) * power / (power + 1e-6 * power.max())
    gate = np.sqrt(np.divide(most, own, out=np.ones_like(own), where=own > most))
    # A gate with corners would ring from loud beginnings into quiet ends.
    gate = gaussian_filter1d(gate, GATE_HZ * len(samples) / sample_rate)
    return np.asarray(irfft(changed * gate, len(samples)))


def predicted_floor(
    forward: Sequence[FloatArray],
    reverse: Sequence[FloatArray],
    sample_rate: int,
    rng: np.random.Generator,
    *,
    flavour: str,
    symbols: Sequence[str],
    temperature_changes: Sequence[float],
    position_m: float,
    count: int | None = None,
    stored: np.dtype[Any] | None = None,
) -> dict[str, float]:
    """Return the mean distance that noise, air and places alone would leave.

    Parameters
    ----------
    forward, reverse : sequence of ndarray, shape (n,)
        Both directions of each pair.
    sample_rate : int
        Samples per second [Hz].
    rng : numpy.random.Generator
        Draws worsened responses, 20 or more in all.
    flavour : str
        Flavour of the metrics.
    symbols : sequence of str
        Metrics to predict.
    temperature_changes : sequence of float
        Logged warming of each pair [K]; NaN counts as none.
    position_m : float
        Repeatability of a place [m].
    count : int, optional
        Samples compared.
    stored : dtype, optional
        How responses are stored: rounding is a noise too, where a band is empty.
    """
    draws = max(1, round(FEWEST_DRAWS / max(1, len(forward))))
    pairs = [*zip(forward, reverse, temperature_changes, strict=True)] * draws
    truths, guesses = [], []
    for f, r, warming in pairs:
        truth = f[:count]
        guess = worsened(
            f,
            r,
            sample_rate,
            rng,
            temperature_change=float(np.nan_to_num(warming)),
            position_m=position_m,
        )[:count]
        truths.append(truth.astype(stored or truth.dtype).astype(np.float64))
        guesses.append(guess.astype(stored or guess.dtype).astype(np.float64))
    floors = {}
    for symbol in symbols:
        chosen = METRICS[symbol].flavour(flavour)
        both = []
        for pair in zip(truths, guesses, strict=True):
            truth, guess = (chosen.describe(h, sample_rate) for h in pair)
            both += [chosen.compare(truth, guess), chosen.compare(guess, truth)]
        kept = [float(v) for v in both if np.isfinite(v)]
        floors[symbol] = float(np.mean(kept)) if kept else float("nan")
    return floors
