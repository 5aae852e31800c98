"""Octave and fractional-octave bands: centres, filters without delay, energies.

All split sound by windows on its spectrum, so that no band is delayed. The windows
differ on purpose:

- `Band`: the magnitude of a Butterworth band-pass, as standards ask of parameters;
- `crossover_gains`: gains of neighbours add up to one, so that sound split into bands
  is whole again when they are summed (`join_bands`);
- `octave_energies`: sharp edges, so that each bin's energy counts once.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir.arrays import FloatArray
from rir.errors import SignalError

__all__ = [
    "Band",
    "bands_of",
    "crossover_gains",
    "exact_centers",
    "join_bands",
    "octave_centers",
    "octave_energies",
    "third_octave_centers",
]

RATIO = 10.0**0.3
"""Octave frequency ratio G (IEC 61260-1:2014, 5.2)."""
ORDER = 6
"""Butterworth order; 3 would meet class 1, 6 keeps bands narrow to compute."""
DEPTH = 1e-7
"""The window is cut where its squared magnitude falls below this: at -70 dB."""
RINGING_S = 0.04
"""Room behind the samples for what the lowest band's filter rings [s]."""


@dataclass(frozen=True)
class Band:
    """A fractional-octave band.

    Examples
    --------
    >>> octave = Band(1000.0, 1)
    >>> round(float(octave.power(np.array([octave.upper]))[0]), 3)
    0.5
    """

    center: float
    """Exact midband frequency [Hz]."""
    fraction: int
    """1 for octaves, 3 for third octaves."""
    zero_phase: bool = False
    """Whether the filter runs forward and backward: twice the attenuation, still no
    delay."""

    @cached_property
    def lower(self) -> float:
        """Lower band edge [Hz]."""
        return self.center * RATIO ** (-0.5 / self.fraction)

    @cached_property
    def upper(self) -> float:
        """Upper band edge [Hz]."""
        return self.center * RATIO ** (0.5 / self.fraction)

    @cached_property
    def width(self) -> float:
        """Bandwidth [Hz]."""
        return self.upper - self.lower

    def power(self, frequencies: FloatArray) -> FloatArray:
        """Return the squared magnitude at positive frequencies [Hz]."""
        edge = (self.upper - self.lower) / self.center
        detuning = frequencies / self.center - self.center / frequencies
        power = 1.0 / (1.0 + (detuning / edge) ** (2 * ORDER))
        return power**2 if self.zero_phase else power

    def window(self, rate: float, length: int) -> tuple[int, NDArray[np.float32]]:
        """Return the first bin and the magnitudes of a transform of `length`."""
        depth = DEPTH ** (1.0 / (2 * ORDER))
        edge = (self.upper - self.lower) / self.center
        reach = 0.5 * edge / depth
        far = reach + np.sqrt(reach**2 + 1.0)
        step = rate / length
        first = max(int(self.center / far / step), 1)
        last = min(int(self.center * far / step) + 1, length // 2)
        frequencies = np.arange(first, last + 1, dtype=np.float64) * step
        return first, np.sqrt(self.power(frequencies)).astype(np.float32)


def exact_centers(centers: ArrayLike, fraction: int) -> FloatArray:
    """Return the exact midband frequencies nearest to nominal ones [Hz].

    f_m = 1000 G^(k/b), G = 10^0.3 (IEC 61260-1:2014, 5.4).

    Examples
    --------
    >>> exact_centers([125, 1000], 1).round(2)
    array([ 125.89, 1000.  ])
    """
    nominal = np.asarray(centers, dtype=np.float64)
    step = fraction * np.log(nominal / 1000.0) / np.log(RATIO)
    return 1000.0 * RATIO ** (np.round(step) / fraction)


def bands_of(
    centers: Sequence[float] | ArrayLike, fraction: int | None, *, zero_phase: bool
) -> tuple[Band, ...]:
    """Return bands at nominal centres; thirds if one of them is no octave's.

    Raises
    ------
    SignalError
        If there is no centre, or one is not a positive frequency.
    """
    nominal = np.atleast_1d(np.asarray(centers, dtype=np.float64))
    if nominal.ndim != 1 or nominal.size == 0:
        raise SignalError("give at least one band centre in Hz")
    if not np.all(np.isfinite(nominal) & (nominal > 0.0)):
        raise SignalError(f"band centres must be positive Hz, not {nominal.tolist()}")
    if fraction is None:
        octaves = np.log(nominal / 1000.0) / np.log(RATIO)
        fraction = 1 if np.all(np.abs(octaves - np.round(octaves)) < 0.1) else 3
    if fraction not in (1, 3):
        raise SignalError(f"bands are octaves (1) or thirds (3), not 1/{fraction}")
    exact = exact_centers(nominal, fraction)
    return tuple(Band(float(center), fraction, zero_phase) for center in exact)


@lru_cache(maxsize=64)
def cached_window(
    band: Band, rate: float, length: int
) -> tuple[int, NDArray[np.float32]]:
    """Return the band's window, kept for the next response of the same length."""
    return band.window(rate, length)


@lru_cache(maxsize=8)
def cached_weights(
    bands: tuple[Band, ...], rate: float, length: int
) -> NDArray[np.float32]:
    """Return each band's share of the energy of each bin but the first."""
    frequencies = np.arange(1.0, length // 2 + 1.0) * (rate / length)
    weights = np.stack([band.power(frequencies) for band in bands], axis=-1)
    return (weights * (2.0 / length)).astype(np.float32)


def octave_centers(low: float = 125.0, high: float = 8000.0) -> FloatArray:
    """Return the nominal octave-band centres from `low` to `high` [Hz].

    Examples
    --------
    >>> octave_centers(250, 2000).tolist()
    [250.0, 500.0, 1000.0, 2000.0]
    """
    nominal = np.array([16, 31.5, 63, 125, 250, 500, 1e3, 2e3, 4e3, 8e3, 16e3])
    return nominal[(nominal >= low * 0.99) & (nominal <= high * 1.01)]


def third_octave_centers(low: float = 50.0, high: float = 10e3) -> FloatArray:
    """Return the exact base-ten third-octave centres from `low` to `high` [Hz].

    References
    ----------
    IEC 61260-1:2014, clause 5.4: f = 1000 G^(k/3), G = 10^0.3.
    """
    first = np.ceil(3 * np.log(low * 0.98 / 1000) / np.log(RATIO))
    last = np.floor(3 * np.log(high * 1.02 / 1000) / np.log(RATIO))
    return 1000.0 * RATIO ** (np.arange(first, last + 1) / 3)


@lru_cache(maxsize=32)
def crossover_gains(
    centers: tuple[float, ...], sample_rate: int, length: int
) -> FloatArray:
    """Return the real gain of each band's filter at the bins of a real FFT.

    Neighbours cross over as cos² and sin² of log f, so the gains add to one at
    every frequency: sound whose bands all have gain 1 comes back untouched. The
    outermost bands reach down to 0 Hz and up to the Nyquist frequency.

    Returns
    -------
    ndarray, shape (bands, length // 2 + 1)
    """
    f = np.fft.rfftfreq(length, 1 / sample_rate)
    place = np.interp(
        np.log(np.maximum(f, 1e-3)), np.log(centers), np.arange(len(centers))
    )
    distance = np.abs(place - np.arange(len(centers))[:, None])
    return np.where(distance < 1, np.cos(np.pi / 2 * np.minimum(distance, 1)) ** 2, 0)


@lru_cache(maxsize=32)
def _joining(
    centers: tuple[float, ...], of_band: tuple[int, ...], rate: int, length: int
) -> list[tuple[slice, FloatArray]]:
    """Return for each signal the bins where it has a part, and its gains there."""
    gains = crossover_gains(centers, rate, length)
    parts = []
    for signal in range(max(of_band) + 1):
        whole = gains[np.equal(of_band, signal)].sum(axis=0)
        some = np.nonzero(whole)[0]
        inside = slice(int(some[0]), int(some[-1]) + 1) if len(some) else slice(0)
        parts.append((inside, whole[inside]))
    return parts


def join_bands(
    signals: FloatArray,
    centers: Sequence[float] | FloatArray,
    sample_rate: int,
    of_band: Sequence[int] | None = None,
) -> FloatArray:
    """Filter each band's signal, shape (signals, n), and return their sum, shape (n,).

    Parameters
    ----------
    signals : ndarray, shape (signals, n)
        One for each band, or fewer if bands share one.
    centers : ndarray, shape (bands,)
        Band centres [Hz].
    sample_rate : int
        Samples per second [Hz].
    of_band : sequence of int, optional
        The signal of each band; its own by default.
    """
    from scipy.fft import irfft, next_fast_len, rfft

    n = signals.shape[-1]
    length = int(next_fast_len(n + int(RINGING_S * sample_rate), real=True) or 0)
    shared = range(len(centers)) if of_band is None else of_band
    parts = _joining(tuple(map(float, centers)), tuple(shared), sample_rate, length)
    total = np.zeros(length // 2 + 1, dtype=np.complex128)
    spectra: Any = rfft(signals, length, axis=-1)
    for spectrum, (inside, gains) in zip(spectra, parts, strict=True):
        total[inside] += gains * spectrum[inside]
    return np.asarray(irfft(total, length))[:n]


def octave_energies(
    power: FloatArray, n_fft: int, sample_rate: int, centers: FloatArray
) -> FloatArray:
    """Return the sums of a power spectrum over octaves, shape (octaves,).

    Parameters
    ----------
    power : ndarray, shape (n_fft // 2 + 1,)
        Of the bins of a real transform.
    n_fft : int
        Length of the transform.
    sample_rate : int
        Rate [Hz].
    centers : ndarray, shape (octaves,)
        Octave centres [Hz].
    """
    edges = np.stack((centers / np.sqrt(2), centers * np.sqrt(2)))
    low, high = np.ceil(edges * n_fft / sample_rate).astype(int)
    total = np.concatenate(([0.0], np.cumsum(power)))
    return total[np.minimum(high, len(power))] - total[np.minimum(low, len(power))]
