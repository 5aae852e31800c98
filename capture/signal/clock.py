"""Latency and clock drift of a loopback, from one take."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.signal.excitation import Excitation

__all__ = ["UNKNOWN_CLOCK", "RecorderClock", "fit_clock"]

Array = NDArray[np.float64]

WINDOW_S = 0.025  # a cable's response, its low end included
WINDOW_PER_SAMPLE = 3e-4  # and what 300 ppm of drift spreads it by
LOWEST_HZ = 200.0  # below, AC coupling turns the phase
FEWEST = 16  # frequencies for a fit of five unknowns
ROUNDS = 4  # rounds; two usually do
SETTLED = 1e-11  # of the rate: 1e-5 samples over a million
TRUSTED_SIGMAS = 4.0  # one false drift in some ten thousand takes
DOUBT = 2.5  # times what a converter's cubic phase can pose as (decision 0010)
SMALLEST_DRIFT = 2e-8  # 0.01 samples in 10 s of sweep: not worth correcting


@dataclass(frozen=True)
class RecorderClock:
    """How a recorder's time runs against the player's.

    A signal x of the player is recorded as ``x((1 + drift) (t - latency))``.
    """

    latency: float
    """Delay, samples; NaN when nothing tells it."""
    drift: float
    """Relative difference of the rates."""
    drift_sigma: float
    """Standard error of `drift` by the noise."""
    doubt: float = 0.0
    """How much `drift` changes when the converters may have a cubic phase: what a
    filter can pose as."""

    @property
    def runs_off(self) -> bool:
        """Whether a drift is there beyond its own uncertainty."""
        limit = max(
            TRUSTED_SIGMAS * self.drift_sigma, DOUBT * self.doubt, SMALLEST_DRIFT
        )
        return bool(abs(self.drift) > limit)


UNKNOWN_CLOCK = RecorderClock(np.nan, 0.0, np.nan)
"""That of a take without a loopback, or with a silent one."""


def fit_clock(loopback: Array, excitation: Excitation) -> RecorderClock:
    """Find latency and drift of a loopback.

    Parameters
    ----------
    loopback : ndarray, shape (n,)
        What came back by cable.
    excitation : Excitation
        What was played.

    Returns
    -------
    RecorderClock
        Latency NaN if the loopback is silent.

    References
    ----------
    ``X(f / (1 + e)) = X(f) - e f X'(f)``: the phase of loopback over excitation is
    ``c - 2 pi f tau + 2 pi e f u(f)`` with u the time at which f is played; for an
    exponential sweep ``u = L ln(f / f1)``. A term in 1/f takes the phase of an
    AC-coupled input.
    """
    if not np.any(loopback):
        return UNKNOWN_CLOCK
    step, sigma = 0.0, np.inf
    drift, spectrum = 0.0, excitation.transform(loopback)
    fit = undrifting = _Phases.of(spectrum, excitation, drift)
    for _ in range(ROUNDS):
        step, sigma = fit.step()
        if abs(step) < max(SETTLED, 0.01 * sigma):
            break
        drift = (1 + drift) * (1 + step) - 1
        fit = _Phases.of(spectrum, excitation, drift)
    doubt = abs(fit.step(cubic=True)[0] - step)
    clock = RecorderClock(fit.latency(), drift, sigma, doubt)
    if clock.runs_off:
        return clock
    still = undrifting.latency(drifts=False)
    return RecorderClock(still, drift, sigma, doubt)


@dataclass(frozen=True, eq=False)
class _Phases:
    """Phases of loopback over excitation, the excitation at some rate."""

    frequencies: Array
    phases: Array
    times: Array
    peak: int
    sample_rate: float

    @staticmethod
    def of(
        spectrum: NDArray[np.complex128], excitation: Excitation, drift: float
    ) -> "_Phases":
        played = excitation.spectrum_at_rate(drift)
        lags = excitation.inverse(excitation.divide(spectrum, played))
        peak = int(np.argmax(np.abs(lags)))
        rate = excitation.sample_rate
        half = round(WINDOW_S * rate + WINDOW_PER_SAMPLE * excitation.n_played)
        half = min(half, lags.size // 4)
        around = np.take(lags, np.arange(peak - half, peak + half), mode="wrap")
        around = around * np.hanning(2 * half + 1)[:-1]
        gains = np.fft.rfft(np.roll(around, -half))
        f = np.asarray(np.fft.rfftfreq(2 * half, 1 / rate), dtype=np.float64)
        low, high = excitation.band
        inside = (f >= max(1.3 * low, LOWEST_HZ)) & (f <= 0.85 * high)
        if np.count_nonzero(inside) < FEWEST:
            inside = (f >= low) & (f <= high)
        if peak > lags.size - excitation.n_played and peak > lags.size // 2:
            peak -= lags.size
        phases = np.unwrap(np.angle(gains[inside]))
        times = excitation.time_played(f[inside])
        return _Phases(f[inside], phases, times, peak, rate)

    def step(self, *, cubic: bool = False) -> tuple[float, float]:
        """Return what is left of the drift, and its standard error."""
        found, errors = self._solve(True, cubic)
        return found[-1] / (2 * np.pi), errors[-1] / (2 * np.pi)

    def latency(self, *, drifts: bool = True) -> float:
        """Return the delay, samples."""
        found, _ = self._solve(drifts, False)
        return float(self.peak - found[1] * self.sample_rate / (2 * np.pi))

    def _solve(self, drifts: bool, cubic: bool) -> tuple[Array, Array]:
        f = self.frequencies
        columns = [np.ones_like(f), f, f[0] / f]
        columns += [f**3] if cubic else []
        columns += [f * self.times] if drifts else []
        return _regress(np.stack(columns, axis=1), self.phases, 1 / np.sqrt(f))


def _regress(columns: Array, phases: Array, weight: Array) -> tuple[Array, Array]:
    units = np.abs(columns).max(axis=0)
    units = np.where(units > 0, units, 1)
    rows = columns / units * weight[:, np.newaxis]
    inverse = np.linalg.pinv(rows)
    found = inverse @ (phases * weight)
    rest = phases * weight - rows @ found
    spread = np.sum(rest**2) / max(weight.size - units.size, 1)
    errors = np.sqrt(spread * np.sum(inverse**2, axis=1))
    return found / units, errors / units
