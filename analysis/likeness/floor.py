"""How close two directions could come, given what the session can hold still."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.likeness.fit import STRETCH_PER_KELVIN, resampled_at
from analysis.likeness.quiet import quiet_part
from analysis.metrics import METRICS

__all__ = ["predicted_floor", "worsened"]

FloatArray = NDArray[np.float64]

ARRIVAL_SECONDS = 0.0005
"""Arrivals this far apart come from independent directions."""


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
        Both directions; their quiet parts give the noise of both takes.
    sample_rate : int
        Samples per second [Hz].
    rng : numpy.random.Generator
        Draws noise and displacements.
    temperature_change : float
        Warming between the takes [K].
    position_m : float
        Standard deviation of each end's place along each axis [m].
    """
    count = len(forward)
    time = np.arange(count) * (1 + STRETCH_PER_KELVIN * temperature_change)
    if position_m > 0:
        # Both ends move: along a ray that is sqrt(2) times one axis.
        knots = np.arange(0, count + 1, max(1, round(ARRIVAL_SECONDS * sample_rate)))
        spread = np.sqrt(2) * position_m / 343.0 * sample_rate
        draws = rng.normal(0, spread, len(knots))
        time = time + np.interp(np.arange(count), knots, draws)
    moved = forward
    if position_m > 0 or temperature_change:
        moved = resampled_at(forward, time)
    own, other = (
        _noise_like(quiet_part(h, sample_rate), count, rng) for h in (forward, reverse)
    )
    # The forward take brings its own noise along. Where sound stands above it both
    # noises make the difference; where there is only noise, two noises are compared.
    sound = _sound_share(forward, np.mean(quiet_part(forward, sample_rate) ** 2))
    return sound * moved + np.sqrt(sound) * own + other


def _sound_share(samples: FloatArray, noise: np.floating[Any]) -> FloatArray:
    """Return the share of the power that is not noise, smoothed, shape (n,)."""
    from scipy.ndimage import uniform_filter1d

    width = max(8, len(samples) // 100)
    power = uniform_filter1d(samples**2, width, mode="nearest")
    return 1.0 - np.minimum(1.0, noise / np.maximum(power, 1e-300))


def _noise_like(quiet: FloatArray, count: int, rng: np.random.Generator) -> FloatArray:
    """Return noise with the spectrum of a quiet part and random phases."""
    from scipy.fft import irfft, rfft

    power = np.abs(np.asarray(rfft(quiet * np.hanning(len(quiet))))) ** 2
    bins = count // 2 + 1
    spread = np.interp(np.linspace(0, 1, bins), np.linspace(0, 1, len(power)), power)
    phases = np.exp(2j * np.pi * rng.random(bins))
    noise = np.asarray(irfft(np.sqrt(spread) * phases, count))
    rms = np.sqrt(np.mean(noise**2))
    return noise * (np.sqrt(np.mean(quiet**2)) / rms) if rms > 0 else noise


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
) -> dict[str, float]:
    """Return the mean distance that noise, air and places alone would leave.

    Parameters
    ----------
    forward, reverse : sequence of ndarray, shape (n,)
        Both directions of each pair.
    sample_rate : int
        Samples per second [Hz].
    rng : numpy.random.Generator
        Draws one worsened response for each pair.
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
    """
    truths, guesses = [], []
    for f, r, warming in zip(forward, reverse, temperature_changes, strict=True):
        truths.append(f[:count])
        guesses.append(
            worsened(
                f,
                r,
                sample_rate,
                rng,
                temperature_change=float(np.nan_to_num(warming)),
                position_m=position_m,
            )[:count]
        )
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
