"""What a recording is divided by: the excitation as the loopback heard it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from capture.signal.clock import UNKNOWN_CLOCK, RecorderClock, fit_clock
from capture.signal.excitation import Excitation

__all__ = ["SweepReference", "refer"]

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

LONGEST_GAIN_S = 0.25  # an input coupled at a few Hz has rung out
SHORTEST_GAIN = 64  # samples: the ringing of a converter's filter
ABOVE_NOISE = 2.0  # 3 dB: mean of a shell that holds response, not noise
WEAK, WEAK_QUANTILE = 0.05, 0.1  # below all but the weakest tenth of the band
LEAST_SHARE = 0.03  # -15 dB: where nothing was played no gain is guessed


@dataclass(frozen=True, eq=False)
class SweepReference:
    """The emitted signal on the recorder's clock."""

    excitation: Excitation
    """What was played."""
    clock: RecorderClock
    """Delay and drift of the recorder."""
    played: ComplexArray
    """Spectrum of the excitation at the recorder's rate, not delayed."""
    gain: ComplexArray
    """Transfer function of the loopback without its delay, noise removed; ones without
    a loopback."""
    loopback: Array | None
    """The recorded loopback, shape (n,)."""

    @cached_property
    def spectrum(self) -> ComplexArray:
        """Spectrum of the reference, delayed as the recording is."""
        if not np.isfinite(self.clock.latency):
            return self.played * self.gain
        turns = self.excitation.frequencies / self.excitation.sample_rate
        delay = np.exp(-2j * np.pi * self.clock.latency * turns)
        return self.played * self.gain * delay

    @cached_property
    def reciprocal(self) -> ComplexArray:
        """What spectra of recordings are multiplied with."""
        return self.excitation.reciprocal(self.spectrum)


def refer(excitation: Excitation, loopback: Array | None) -> SweepReference:
    """Build the reference of a take.

    The loopback gives delay, drift and gain; what lies below its own noise is left
    out, so that the noise of the loopback does not reach the response.

    Parameters
    ----------
    excitation : Excitation
        What was played.
    loopback : ndarray, shape (n,), or None
        What came back by cable.
    """
    ones = np.ones(excitation.frequencies.size, dtype=complex)
    clock = UNKNOWN_CLOCK if loopback is None else fit_clock(loopback, excitation)
    if loopback is None or not np.isfinite(clock.latency):
        return SweepReference(excitation, clock, excitation.spectrum, ones, loopback)
    played = excitation.spectrum_at_rate(clock.drift if clock.runs_off else 0.0)
    gain = _smooth_gain(excitation, loopback, clock, played)
    return SweepReference(excitation, clock, played, gain, loopback)


def _smooth_gain(
    excitation: Excitation, loopback: Array, clock: RecorderClock, played: ComplexArray
) -> ComplexArray:
    """Estimate the loopback's transfer function from its lags above the noise."""
    turns = excitation.frequencies / excitation.sample_rate
    undelayed = excitation.transform(loopback) * np.exp(
        2j * np.pi * clock.latency * turns
    )
    half = _gain_length(excitation, excitation.divide(undelayed, played))
    window = _lag_window(excitation.n, half)
    power = played.real**2 + played.imag**2
    # Whitened: the kernel of a flat-topped window is negative in places, and there
    # a falling spectrum's strong part would outweigh a weak one.
    whiten = 1 / (power + _weakest(excitation, power))
    cross = excitation.inverse(undelayed * np.conj(played) * whiten) * window
    auto = excitation.inverse((power * whiten).astype(complex)) * window
    bottom = excitation.transform(auto).real
    return excitation.transform(cross) / np.maximum(bottom, LEAST_SHARE)


def _weakest(excitation: Excitation, power: Array) -> float:
    """Return a power that little of the band falls below."""
    first, last = np.searchsorted(excitation.frequencies, excitation.band)
    return WEAK * float(np.quantile(power[first:last], WEAK_QUANTILE))


def _gain_length(excitation: Excitation, ratio: ComplexArray) -> int:
    """Return the lag beyond which the loopback's response is noise, samples."""
    lags = excitation.inverse(ratio) ** 2
    half = lags.size // 2
    folded = lags[:half] + lags[::-1][:half]
    longest = min(round(LONGEST_GAIN_S * excitation.sample_rate), folded.size // 4)
    noise = np.median(folded[longest:]) / 0.45
    half = SHORTEST_GAIN
    shell = SHORTEST_GAIN
    while shell < longest:
        stop = min(2 * shell, longest)
        if np.mean(folded[shell:stop]) > ABOVE_NOISE * noise:
            half = stop
        shell *= 2
    return half


def _lag_window(n: int, half: int) -> Array:
    """Return 1 up to `half` samples either way, falling to 0 at twice that."""
    lag = np.minimum(np.arange(n), n - np.arange(n))
    fall = np.clip(2 - lag / half, 0, 1)
    return np.sin(np.pi / 2 * fall) ** 2
