"""The played signal on one grid of frequencies, as all divisions need it."""

from functools import cached_property
from importlib import import_module
from typing import Any

import numpy as np

from capture.signal.resample import evaluate_stretched
from capture.signal.target import band_target, occupied_band, usable_band
from rir.arrays import ComplexArray, FloatArray
from rir.errors import SignalError

__all__ = ["Excitation"]

FLOOR = 1e-6  # of the band's power: a gap in it gets at most 54 dB of gain
GUARD_LOW = 1e-5  # an octave below the band: at most 44 dB of gain
GUARD_HIGH = 0.1  # 3 % above the band: at most 4 dB of gain
TIME_GRID = 96  # ten to an octave: the delay of a sweep is a line in log f


class Excitation:
    """Spectra of an excitation on a grid long enough for one kind of take.

    Parameters
    ----------
    samples : ndarray, shape (m,)
        What was played.
    sample_rate : float
        Sampling rate, Hz.
    n_recorded : int
        Samples of a recording.
    length, pre : int
        Samples to keep from the emission on and before it.
    band : tuple of float, optional
        Flat part of the response, Hz.

    Raises
    ------
    SignalError
        If the excitation is silent or the band cannot be had.
    """

    def __init__(
        self,
        samples: FloatArray,
        sample_rate: float,
        n_recorded: int,
        *,
        length: int,
        pre: int,
        band: tuple[float, float] | None = None,
    ) -> None:
        self._fft: Any = import_module("scipy.fft")
        self.samples = np.asarray(samples, dtype=float)
        self.sample_rate = float(sample_rate)
        self.n_played = self.samples.size
        self.length, self.pre = length, pre
        if not np.any(self.samples) or not np.all(np.isfinite(self.samples)):
            raise SignalError(
                "the excitation is silent or not finite: nothing to divide by"
            )
        # Nothing stands before minus the excitation's length, so this wraps nothing
        # into the kept part.
        self.n = self._fft.next_fast_len(
            max(n_recorded, self.n_played + length) + pre, real=True
        )
        self.occupied = occupied_band(np.abs(self.spectrum) ** 2, self.sample_rate)
        self.band = usable_band(band, self.occupied, self.sample_rate)

    def transform(self, signals: FloatArray) -> ComplexArray:
        """Return the spectrum of signals on the grid."""
        return self._fft.rfft(signals, self.n, workers=2)

    def inverse(self, spectra: ComplexArray) -> FloatArray:
        """Return the signals of spectra on the grid; negative lags are at the end."""
        return self._fft.irfft(spectra, self.n, workers=2)

    @cached_property
    def frequencies(self) -> FloatArray:
        """Frequencies of the grid, Hz."""
        return np.arange(self.n // 2 + 1) * (self.sample_rate / self.n)

    @cached_property
    def spectrum(self) -> ComplexArray:
        """Spectrum of what was played."""
        return self._fft.rfft(self.samples, self.n)

    @cached_property
    def target(self) -> ComplexArray:
        """The band's gain, see `capture.signal.target`."""
        return band_target(
            self.frequencies,
            self.band,
            self.occupied,
            self.pre / self.sample_rate,
            self.length / self.sample_rate,
        )

    @cached_property
    def _timing(self) -> tuple[FloatArray, FloatArray]:
        """Frequencies and the times at which they are played, s."""
        times = np.arange(self.n_played) / self.sample_rate
        slope = self._fft.rfft(times * self.samples, self.n)
        top = slope * np.conj(self.spectrum)
        first, last = np.searchsorted(self.frequencies, self.band)
        edges = np.unique(
            np.geomspace(float(first), float(last), TIME_GRID).round().astype(int)
        )
        sums = np.add.reduceat(top.real[: edges[-1]], edges[:-1])
        power = np.abs(self.spectrum[: edges[-1]]) ** 2
        means = sums / np.add.reduceat(power, edges[:-1])
        centers = np.sqrt(self.frequencies[edges[:-1]] * self.frequencies[edges[1:]])
        return centers, means

    @cached_property
    def _line(self) -> tuple[float, float]:
        """Slope and start of the times over the logarithms of the frequencies."""
        centers, means = self._timing
        slope, start = np.polyfit(np.log(centers), means, 1)
        return float(slope), float(start)

    def time_played(self, frequencies: FloatArray) -> FloatArray:
        """Return when frequencies are played: the excitation's group delay, s."""
        centers, means = self._timing
        logs = np.log(centers)
        wanted = np.log(frequencies)
        inner = np.interp(wanted, logs, means)
        slope, _ = self._line
        return (
            inner
            + slope * np.minimum(wanted - logs[0], 0)
            + slope * np.maximum(wanted - logs[-1], 0)
        )

    @cached_property
    def rate(self) -> float:
        """Seconds in which the frequency grows by e; 0 for what is no sweep."""
        centers, means = self._timing
        logs = np.log(centers)
        slope, start = self._line
        spread = np.std(means - slope * logs - start)
        return float(slope) if spread < 0.05 * abs(slope) else 0.0

    def spectrum_at_rate(self, drift: float) -> ComplexArray:
        """Return the spectrum of the excitation at times that run faster."""
        if drift == 0.0:
            return self.spectrum
        n, whole = self._whole
        count = int(self.n_played / (1 + drift))
        return self._fft.rfft(evaluate_stretched(whole, n, count, drift), self.n)

    @cached_property
    def _whole(self) -> tuple[int, ComplexArray]:
        """Length and spectrum of the excitation with only a little silence behind."""
        n = self._fft.next_fast_len(self.n_played + 4096, real=True)
        return n, self._fft.rfft(self.samples, n)

    @cached_property
    def inverse_spectrum(self) -> ComplexArray:
        """What to multiply with instead of dividing by `spectrum`."""
        return self.reciprocal(self.spectrum)

    def divide(self, spectrum: ComplexArray, by: ComplexArray) -> ComplexArray:
        """Divide two spectra inside the band."""
        if by is self.spectrum:
            return spectrum * self.inverse_spectrum
        return spectrum * self.reciprocal(by)

    def reciprocal(self, spectrum: ComplexArray) -> ComplexArray:
        """Return the band's gain over a spectrum, bounded where that is weak."""
        power = spectrum.real**2 + spectrum.imag**2
        f, (low, high) = self.frequencies, self.band
        first, last = np.searchsorted(f, (low, high))
        bound = np.full(f.size, FLOOR * np.median(power[first:last]))
        edge = np.median(power[first : max(np.searchsorted(f, 1.3 * low), first + 1)])
        below = np.clip(np.log2(low / np.maximum(f[:first], 1e-9)), 0, 1)
        bound[:first] = np.maximum(
            bound[:first], GUARD_LOW * edge * np.sin(np.pi / 2 * below) ** 2
        )
        edge = np.median(power[np.searchsorted(f, high / 1.1) : last])
        above = np.clip((f[last:] / high - 1) / 0.03, 0, 1)
        bound[last:] = np.maximum(bound[last:], GUARD_HIGH * edge * above**2)
        return self.target * np.conj(spectrum) / (power + bound)
