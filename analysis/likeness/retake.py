"""What a second take of the same response would have recorded: noise of its own.

Where a response x = s + n holds signal of power S and noise of power N, its best guess
of the signal is w x with w = S / (S + N), wrong by a variance of w N. Another take with
noise of power M is therefore w x plus noise of power w N + M: its power is S + M, and
what it has in common with x is S, as it must be. So noise is replaced, not added.
"""

import numpy as np

from analysis.likeness.bandwise import Bands, ThirdOctave, noise_density, padded_size
from analysis.likeness.quiet import quiet_part
from rir.arrays import FloatArray

__all__ = ["retaken", "steady_part"]

SMOOTH_SECONDS = 0.015
"""Powers are smoothed over this [s]: little beside a decay, much beside noise."""
SMOOTH_PERIODS = 6.0
"""Low bands are smoothed over so many periods, as their noise is slower."""
SIGMAS = 5.0
"""Standard deviations by which an earlier stretch may exceed the noise behind it."""


def steady_part(samples: FloatArray, sample_rate: int) -> FloatArray:
    """Return the quiet part, reaching back as far as its level stays the same.

    Parameters
    ----------
    samples : ndarray, shape (n,)
        Response.
    sample_rate : int
        Samples per second [Hz].
    """
    quiet = quiet_part(samples, sample_rate)
    step, kept = len(quiet), len(quiet)
    if not np.array_equal(quiet, samples[-step:]):
        return quiet
    most = 1 + SIGMAS * np.sqrt(2 / step)
    while kept + step < len(samples):
        level = np.mean(samples[-kept:] ** 2)
        if np.mean(samples[-kept - step : -kept] ** 2) > most * level:
            break
        kept += step
    return samples[-kept:]


def retaken(
    samples: FloatArray,
    own: FloatArray,
    other: FloatArray,
    sample_rate: int,
    rng: np.random.Generator,
) -> FloatArray:
    """Return a response with its noise replaced by noise of another take.

    Parameters
    ----------
    samples : ndarray, shape (n,)
        Response with noise.
    own, other : ndarray, shape (k,)
        Noise of this take, and of the one to make up.
    sample_rate : int
        Samples per second [Hz].
    rng : numpy.random.Generator
        Draws the noise.

    References
    ----------
    Wiener, "Extrapolation, Interpolation, and Smoothing of Stationary Time Series"
    (1949), in third octaves over time.
    """
    from scipy.fft import irfft, rfft

    count = len(samples)
    size = padded_size(count, sample_rate)
    spectrum = np.asarray(rfft(samples, size), dtype=np.complex128)
    before, after = (_density(part, len(spectrum)) for part in (own, other))
    bands = Bands(spectrum, size, sample_rate, before)
    shape = np.sqrt(np.maximum(after, np.finfo(float).tiny)).astype(np.complex128)
    fresh = Bands(shape, size, sample_rate, np.zeros(len(after)))
    noise, taken = np.zeros(len(spectrum), dtype=np.complex128), np.zeros(size)
    for band in bands.table:
        share = _share(bands, band)
        places = np.arange(len(share)) * (size / len(share))
        shares = np.interp(np.arange(size), places, share)
        # Filtered once and softly: what rings off a loud beginning stays under it.
        part = np.zeros(len(spectrum), dtype=np.complex128)
        part[band.bins] = spectrum[band.bins] * band.weights**2
        taken += np.asarray(irfft(part, size)) * (shares - 1)
        was, will = (
            np.sum(band.weights**2 * density[band.bins]) / size
            for density in (before, after)
        )
        fresh.add_noise(noise, band, share * was + will, np.ones(len(noise)), rng)
    return samples + (np.asarray(irfft(noise, size)) + taken)[:count]


def _density(noise: FloatArray, bins: int) -> FloatArray:
    """Return the density of noise, of exactly its power."""
    density = noise_density(noise, bins)
    total = float(np.mean(density))
    return density * (np.mean(noise**2) / total if total > 0 else 0.0)


def _share(bands: Bands, band: ThirdOctave) -> FloatArray:
    """Return the signal's share of the power of a band over time."""
    spread = max(SMOOTH_SECONDS, SMOOTH_PERIODS / band.center)
    power, floor = bands.power(band, spread)
    freedom = max(1.0, 2 * np.sqrt(np.pi) * spread * 0.23 * band.center)
    clear = power > floor * (1 + 2 / np.sqrt(freedom))
    return 1 - np.divide(floor, power, out=np.ones_like(power), where=clear)
