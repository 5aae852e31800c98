"""What a response becomes when both ends are put up again a little elsewhere.

A plane wave that leaves along u and arrives from v is delayed by (a.u + b.v) / c when
the ends move by a and b. An arrival that stands alone is one such wave. Where many
overlap in a diffuse field, what stays alike of them at wavenumber k is the mean of
exp(jk(a.u + b.v)) over all directions, sin(k|a|)/(k|a|) sin(k|b|)/(k|b|); the rest is
replaced by noise of the same energy in time and frequency.
"""

import numpy as np

from analysis.likeness.arrivals import Arrival, split_arrivals
from analysis.likeness.bandwise import Bands, noise_density, padded_size, smoothed
from analysis.likeness.quiet import quiet_part
from rir.arrays import ComplexArray, FloatArray
from rir.onset import find_onset

__all__ = ["coherence", "displaced"]

SPEED = 343.0
"""Of sound, near 20 °C [m/s]: 1 % of it counts no more than 1 % of repeatability."""
RINGING_SECONDS = 0.002
"""A displaced arrival rings this long about its own window at most."""
LEAD_SECONDS = 0.0004
"""Smoothed powers reach before the direct sound, what is shaped by them must not."""
DEEPEST = 0.01
"""Gaps in the spectrum are filled up to this much of its largest magnitude."""


def coherence(wavenumbers: FloatArray, moves: FloatArray) -> FloatArray:
    """Return how alike a diffuse response stays when its ends move, shape (k,).

    Parameters
    ----------
    wavenumbers : ndarray, shape (k,)
        2 pi f / c [rad/m].
    moves : ndarray, shape (ends, 3)
        Displacement of each end [m].

    References
    ----------
    Cook et al., "Measurement of correlation coefficients in reverberant sound
    fields", J. Acoust. Soc. Am. 27 (1955), for one end. Averaged over normally
    distributed displacements of standard deviation s along each axis, an end gives
    exp(-(k s)^2 / 2).

    Examples
    --------
    >>> float(coherence(np.array([0.0]), np.ones((2, 3)))[0])
    1.0
    """
    lengths = np.linalg.norm(moves, axis=1)
    return np.prod(np.sinc(np.outer(wavenumbers, lengths) / np.pi), axis=1)


def displaced(
    samples: FloatArray, sample_rate: int, rng: np.random.Generator, position_m: float
) -> FloatArray:
    """Return the response as another visit to both places would have shown it.

    Parameters
    ----------
    samples : ndarray, shape (n,)
        Response; its noise stays as it is.
    sample_rate : int
        Samples per second [Hz].
    rng : numpy.random.Generator
        Draws displacements, directions and what replaces the diffuse part.
    position_m : float
        Standard deviation of one visit to a place along each axis [m]; the response
        and its copy are two visits.
    """
    from scipy.fft import irfft, rfft

    moves = rng.normal(0.0, position_m * np.sqrt(2), (2, 3))
    count = len(samples)
    size = padded_size(count, sample_rate)
    spectrum = np.asarray(rfft(samples, size), dtype=np.complex128)
    colour = _colour(spectrum)
    # Without the loudspeaker's colour arrivals are short, and cut ends fill no gaps.
    plain = np.asarray(irfft(spectrum / colour, size))
    arrivals, rest = split_arrivals(plain, sample_rate)
    change = np.zeros(size)
    for arrival in arrivals:
        ways = rng.standard_normal((2, 3))
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        _add_change(change, arrival, float(np.sum(ways * moves)), sample_rate)
    changed = np.asarray(rfft(change)) * colour
    dense = np.asarray(rfft(rest), dtype=np.complex128) * colour
    noise = noise_density(quiet_part(samples, sample_rate), len(colour))
    changed += _dense_change(Bands(dense, size, sample_rate, noise), moves, rng)
    onset = float(find_onset(samples)) / sample_rate
    first = onset - LEAD_SECONDS - 6 * position_m / SPEED
    ramp = np.clip(1 + (np.arange(count) / sample_rate - first) / LEAD_SECONDS, 0, 1)
    return samples + np.asarray(irfft(changed, size))[:count] * ramp


def _colour(spectrum: ComplexArray) -> FloatArray:
    power = smoothed(np.abs(spectrum) ** 2)
    return np.sqrt(power + DEEPEST**2 * power.max() + np.finfo(float).tiny)


def _add_change(
    change: FloatArray, arrival: Arrival, longer: float, sample_rate: int
) -> None:
    """Add what one arrival becomes on a path longer by some metres."""
    from scipy.fft import irfft, next_fast_len, rfft

    count, margin = len(arrival.samples), round(RINGING_SECONDS * sample_rate)
    size = int(next_fast_len(count + 2 * margin, real=True) or 0)
    padded = np.zeros(size)
    padded[margin : margin + count] = arrival.samples
    turn = 2 * np.pi * np.fft.rfftfreq(size) * longer / SPEED * sample_rate
    distance = max(arrival.middle / sample_rate * SPEED, abs(longer), 1e-3)
    ratio = distance / max(distance + longer, distance / 2)
    moved = np.asarray(rfft(padded)) * (ratio * np.exp(-1j * turn) - 1)
    taper = np.minimum(1.0, np.minimum(np.arange(size), np.arange(size)[::-1]) / margin)
    local = np.asarray(irfft(moved, size)) * np.sin(np.pi / 2 * taper) ** 2
    first = arrival.start - margin
    low, high = max(0, first), min(len(change), first + size)
    change[low:high] += local[low - first : high - first]


def _dense_change(
    bands: Bands, moves: FloatArray, rng: np.random.Generator
) -> ComplexArray:
    """Return the change of the spectrum of overlapping arrivals."""
    wavenumbers = np.asarray(2 * np.pi / SPEED * bands.frequency, dtype=np.float64)
    alike = coherence(wavenumbers, moves)
    changed = np.zeros(len(alike), dtype=np.complex128)
    for band in bands.table:
        kept, power = bands.signal(band)
        bands.add(changed, band, kept, alike - 1)
        bands.add_noise(changed, band, power, np.sqrt(1 - alike**2), rng)
    return changed
