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

    The noise of the forward take stays in it; `noisier` gives the response to
    compare with, so that each of the two has one noise of its own.

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
    count = len(forward)
    time = np.arange(count) * (1 + STRETCH_PER_KELVIN * temperature_change)
    if position_m > 0:
        # Both ends are visited twice: along a ray that is twice one axis.
        knots = np.arange(0, count + 1, max(1, round(ARRIVAL_SECONDS * sample_rate)))
        spread = 2 * position_m / 343.0 * sample_rate
        draws = rng.normal(0, spread, len(knots))
        time = time + np.interp(np.arange(count), knots, draws)
    moved = forward
    if position_m > 0 or temperature_change:
        moved = forward + _in_band(resampled_at(forward, time) - forward, forward)
    return moved + _noise_like(quiet_part(reverse, sample_rate), count, rng)


def _in_band(change: FloatArray, samples: FloatArray) -> FloatArray:
    """Return a change without what lies 60 dB under the response's spectrum.

    Interpolation errors would otherwise fill the empty ends of the band, and the
    loudspeaker that empties them acts on every displaced response alike.
    """
    from scipy.fft import irfft, rfft
    from scipy.ndimage import uniform_filter1d

    power = uniform_filter1d(np.abs(np.asarray(rfft(samples))) ** 2, 33, mode="nearest")
    gate = power / (power + 1e-6 * power.max())
    return np.asarray(irfft(np.asarray(rfft(change)) * gate, len(samples)))


def noisier(
    samples: FloatArray, sample_rate: int, rng: np.random.Generator
) -> FloatArray:
    """Return a response with as much noise again as it has."""
    quiet = quiet_part(samples, sample_rate)
    return samples + _noise_like(quiet, len(samples), rng)


def _noise_like(quiet: FloatArray, count: int, rng: np.random.Generator) -> FloatArray:
    """Return noise with the spectrum of a quiet part and random phases."""
    from scipy.fft import irfft, rfft
    from scipy.signal import windows

    # A window without side lobes, or strong bands would fill those that are empty.
    taper = windows.blackmanharris(len(quiet), sym=False)
    power = np.abs(np.asarray(rfft(quiet * taper))) ** 2
    # Cut from a longer one: noise that closed on itself would lack the cut's leakage.
    bins = count + 1
    spread = np.interp(np.linspace(0, 1, bins), np.linspace(0, 1, len(power)), power)
    phases = np.exp(2j * np.pi * rng.random(bins))
    noise = np.asarray(irfft(np.sqrt(spread) * phases, 2 * count))[:count]
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
    stored : dtype, optional
        How responses are stored: rounding is a noise too, where a band is empty.
    """
    truths, guesses = [], []
    for f, r, warming in zip(forward, reverse, temperature_changes, strict=True):
        noised = noisier(f, sample_rate, rng)[:count]
        truths.append(noised.astype(stored or noised.dtype).astype(np.float64))
        guess = worsened(
            f,
            r,
            sample_rate,
            rng,
            temperature_change=float(np.nan_to_num(warming)),
            position_m=position_m,
        )[:count]
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
