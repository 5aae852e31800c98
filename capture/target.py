"""The smooth band in which a response is recovered."""

import numpy as np
from numpy.typing import NDArray

from rir.errors import SignalError

__all__ = ["band_target", "occupied_band", "usable_band"]

Array = NDArray[np.float64]

EDGE_LEVEL = 0.1
TREND_SPAN = 2 ** (1 / 6)


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
    power: Array, sample_rate: float, level: float = EDGE_LEVEL
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
    return edges[inside[0]] * step, edges[inside[-1] + 1] * step


def band_target(
    frequencies: Array, band: tuple[float, float], occupied: tuple[float, float]
) -> Array:
    """Return the gain that is 1 inside a band and rolls off smoothly outside.

    The slopes are sin² in log frequency below and in frequency above the band; they
    use the room that the excitation leaves, because a wide slope rings shortly.

    Parameters
    ----------
    frequencies : ndarray
        Where to evaluate, Hz.
    band : tuple of float
        Flat part, Hz.
    occupied : tuple of float
        Range in which the excitation has energy, Hz.

    Returns
    -------
    ndarray
        Gain between 0 and 1, zero at 0 Hz.
    """
    low, high = band
    floor = min(max(occupied[0], low / 4), low / 2**0.5)
    nyquist = float(frequencies[-1])
    ceiling = min(max(occupied[1], 1.05 * high), 1.4 * high, nyquist)
    ratio = np.maximum(frequencies, 1e-9) / floor
    rise = np.clip(np.log(ratio) / np.log(low / floor), 0, 1)
    target = np.sin(np.pi / 2 * rise) ** 2
    if ceiling > high:
        fall = np.clip((ceiling - frequencies) / (ceiling - high), 0, 1)
        target *= np.sin(np.pi / 2 * fall) ** 2
    else:
        target[frequencies > high] = 0
    target[frequencies <= 0] = 0
    return target
