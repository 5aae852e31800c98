"""The smooth band in which a response is recovered."""

from functools import lru_cache

import numpy as np

from capture.signal.least_squares import least_squares
from rir.arrays import ComplexArray, FloatArray
from rir.errors import SignalError

__all__ = ["band_target", "occupied_band", "usable_band"]

EDGE_LEVEL = 0.1  # -20 dB: below, the inverse would raise noise tenfold
TREND_SPAN = 2 ** (1 / 6)
"""Inside the occupied range, whose edges are known to 1/24 octave."""
OVERSAMPLING = 16  # of the band's lower edge: images of the spline below -140 dB
SPLINE_ORDER = 6  # falls by 36 dB an octave, and is short
RING_PERIODS = (6.0, 7.5)  # fewer err inside the band; more gain nothing
RING_SHARE = 0.75  # of the response: the rest is for what rings
LONGEST_PRE_PERIODS = 4.0  # before it nothing is left of the slope
BAND_WEIGHT, SLOPE_WEIGHT = 1e5, 0.05  # the band to -100 dB, the slope as it comes
SMALLEST_SHARE = 1e-12  # of float64: weaker directions are rounding
STOP_PERIODS, STOP_EXPONENTS = (0.3, 1.0), (0.5, 3.0)  # of time before the emission


def usable_band(
    band: tuple[float, float] | None, occupied: tuple[float, float], sample_rate: float
) -> tuple[float, float]:
    """Return the band to recover: the one asked for, or what the excitation covers.

    Parameters
    ----------
    band : tuple of float or None
        What was asked for, Hz.
    occupied : tuple of float
        What the excitation covers, Hz.
    sample_rate : float
        Sampling rate, Hz.

    Raises
    ------
    SignalError
        If the band is empty or reaches beyond half the sampling rate.
    """
    if band is None:
        return occupied[0] * TREND_SPAN, min(
            occupied[1] / TREND_SPAN, 0.98 * sample_rate / 2
        )
    low, high = float(band[0]), float(band[1])
    if not 0 < low < high <= sample_rate / 2:
        raise SignalError(
            f"band {low:g}-{high:g} Hz cannot be recovered at {sample_rate:g} Hz; "
            f"ask for 0 < low < high <= {sample_rate / 2:g} Hz"
        )
    return low, high


def occupied_band(
    power: FloatArray, sample_rate: float, level: float = EDGE_LEVEL
) -> tuple[float, float]:
    """Find where an excitation has energy worth dividing by.

    Parameters
    ----------
    power : ndarray, shape (bins,)
        Power spectrum on the bins of a real FFT.
    sample_rate : float
        Sampling rate, Hz.
    level : float
        Amplitude relative to the typical one at which the band ends.

    Returns
    -------
    tuple of float
        Lowest and highest frequency of the occupied range, Hz.
    """
    edges = np.unique(
        np.geomspace(1, power.size, 1 + 24 * int(np.log2(power.size))).astype(int)
    )
    mean = np.add.reduceat(power[: edges[-1]], edges[:-1]) / np.diff(edges)
    center = np.sqrt(edges[:-1] * (edges[1:] - 1.0))
    # A sweep is pink, noise is white: the median of the pink-weighted spectrum is
    # typical for the first and within a few decibels for the second.
    pink = mean * center
    weight = np.diff(edges) * mean
    order = np.argsort(pink)
    typical = pink[order][np.searchsorted(np.cumsum(weight[order]), weight.sum() / 2)]
    inside = np.flatnonzero(pink >= level**2 * typical)
    step = sample_rate / 2 / (power.size - 1)
    return float(edges[inside[0]] * step), float(edges[inside[-1] + 1] * step)


def band_target(
    frequencies: FloatArray,
    band: tuple[float, float],
    occupied: tuple[float, float],
    pre: float,
    length: float = 0.0,
) -> ComplexArray:
    """Return the gain that is 1 inside a band and rolls off smoothly outside.

    The upper slope is sin² in frequency. The lower slope is shaped so that its
    ringing stands after ``-pre``: cutting a response there then leaves the band
    untouched, which a slope of zero phase does not (-60 dB for 20 Hz and 50 ms).

    Parameters
    ----------
    frequencies : ndarray
        Where to evaluate, equally spaced from 0, Hz.
    band : tuple of float
        Flat part, Hz.
    occupied : tuple of float
        Range in which the excitation has energy, Hz.
    pre : float
        Time before the emission that is kept, s.
    length : float
        Time after the emission that is kept, s: the slope rings longer, and errs
        less, where there is room for it.

    Returns
    -------
    ndarray, complex
        Gain, zero at 0 Hz, 1 within 1e-4 inside the band.
    """
    low, high = band
    floor = min(max(occupied[0], low / 4), low / 2**0.5)
    floor = low / 2 ** (round(24 * np.log2(low / floor)) / 24)
    nyquist = float(frequencies[-1])
    ceiling = min(max(occupied[1], 1.05 * high), 1.4 * high, nyquist)
    pre = min(pre, LONGEST_PRE_PERIODS / low)
    ring = round(float(np.clip(RING_SHARE * length * low, *RING_PERIODS)), 1) / low
    target = 1 - _low_part(frequencies, low, floor, pre, ring)
    if ceiling > high:
        fall = np.clip((ceiling - frequencies) / (ceiling - high), 0, 1)
        target *= np.sin(np.pi / 2 * fall) ** 2
    else:
        target[frequencies > high] = 0
    target[frequencies <= 0] = 0
    return target


def _low_part(
    frequencies: FloatArray, low: float, floor: float, pre: float, ring: float
) -> ComplexArray:
    """Return a low-pass whose impulse response lasts from ``-pre`` to `ring`."""
    times, weights = _low_pass(low, floor, round(pre * low, 2) / low, ring)
    rate = OVERSAMPLING * low
    gain = np.zeros(frequencies.size, dtype=complex)
    below = np.searchsorted(frequencies, rate)
    # The spline is smooth: what lies above its rate is below -150 dB.
    step = float(frequencies[1])
    turn = np.exp(-2j * np.pi * step * times)
    power = np.ones_like(turn)
    chunk = 256
    powers = np.empty((chunk, times.size), dtype=complex)
    for row in powers:
        row[:] = power
        power = power * turn
    for start in range(0, below, chunk):
        base = weights * np.exp(-2j * np.pi * start * step * times)
        stop = min(start + chunk, below)
        # Summed by hand: small matrices wake BLAS threads, which cost more.
        gain[start:stop] = (powers[: stop - start] * base).sum(axis=1)
    gain *= np.sinc(frequencies / rate) ** SPLINE_ORDER
    return gain


@lru_cache(maxsize=64)
def _low_pass(
    low: float, floor: float, pre: float, ring: float
) -> tuple[FloatArray, FloatArray]:
    """Design spline weights: 1 below `floor`, 0 above `low`, nothing before -pre."""
    rate = OVERSAMPLING * low
    span = pre + ring
    count = int(span * rate) - SPLINE_ORDER
    times = -pre + (SPLINE_ORDER / 2 + np.arange(count)) / rate
    grid = np.arange(0, rate / 2, 1 / (3 * span))
    waves: ComplexArray = np.exp(-2j * np.pi * np.outer(grid, times))
    waves *= (np.sinc(grid / rate) ** SPLINE_ORDER)[:, np.newaxis]
    rise = np.clip(np.log(np.maximum(grid, 1e-9) / floor) / np.log(low / floor), 0, 1)
    # Without time before the emission nothing can be stopped below the band.
    stop = 10 ** np.interp(pre * low, STOP_PERIODS, STOP_EXPONENTS)
    weight = np.where(grid <= floor, stop, SLOPE_WEIGHT)
    weight = np.where(grid >= 0.999 * low, BAND_WEIGHT, weight)
    waves *= weight[:, np.newaxis]
    wanted = weight * np.cos(np.pi / 2 * rise) ** 2
    matrix = np.concatenate((np.real(waves), np.imag(waves)))
    right = np.concatenate((wanted, np.zeros_like(wanted)))
    weights = least_squares(matrix, right, SMALLEST_SHARE)
    return np.asarray(times, dtype=np.float64), np.asarray(weights, dtype=np.float64)
