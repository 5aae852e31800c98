"""A closer look at the loopback: what does not fit, and where it slipped."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from capture.signal.energy import BLOCK_S
from capture.signal.reference import SweepReference
from capture.signal.residual import block_energies

__all__ = ["Cable", "Slip"]

Array = NDArray[np.float64]

HALF_S = 0.005  # an AC-coupled input rings a few ms; a room, tens
SEGMENT_S = 0.04  # several periods of the lowest tone, yet short beside a sweep
LOWEST_HZ = 80.0  # three periods in a segment: fewer give no sure lag
FARTHEST_S = 0.012  # a block of 512 samples at 44.1 kHz, the usual loss
SMALLEST_SLIP = 0.6  # samples: a slip is whole, its estimate errs by less than half
SMALLEST_TURN = 0.03  # radians: less phase than a filter bends between segments


@dataclass(frozen=True)
class Slip:
    """A change of delay inside a take."""

    samples: float
    """How much later the sound comes afterwards; negative when samples were lost."""
    time: float
    """When, s from the recording's start."""


@dataclass(frozen=True, eq=False)
class Cable:
    """The loopback of a take."""

    reference: SweepReference
    """The take's reference; it has a loopback with a known latency."""

    @property
    def samples(self) -> Array:
        """The recorded loopback."""
        loopback = self.reference.loopback
        return np.zeros(0) if loopback is None else loopback

    @cached_property
    def compactness(self) -> float:
        """Share of the loopback's response within 5 ms of its peak."""
        return self.compactness_of(self.samples)

    def compactness_of(self, recorded: Array) -> float:
        """Return the same share for any recorded channel.

        Parameters
        ----------
        recorded : ndarray, shape (n,)
            The channel.
        """
        excitation = self.reference.excitation
        half = round(HALF_S * excitation.sample_rate)
        spectrum = excitation.transform(recorded - recorded.mean())
        lags = excitation.inverse(excitation.divide(spectrum, self.reference.played))
        power = lags**2
        around = np.arange(-half, half) + int(np.argmax(power))
        near = power.take(around, mode="wrap").sum()
        return float(near / max(power.sum(), 1e-300))

    @cached_property
    def residual_db(self) -> Array:
        """Unexplained part per 10 ms block, dB relative to the loopback."""
        excitation = self.reference.excitation
        rate = excitation.sample_rate
        model = excitation.inverse(self.reference.spectrum)[: self.samples.size]
        rest = self.samples - self.samples.mean() - model
        size = max(round(BLOCK_S * rate), 8)
        energies = block_energies(rest[np.newaxis], size)[0]
        return 10 * np.log10(energies / (size * self.power) + 1e-30)

    @cached_property
    def power(self) -> float:
        """Mean square of the loopback while the sweep plays."""
        total = float(np.sum((self.samples - self.samples.mean()) ** 2))
        count = min(self.reference.excitation.n_played, self.samples.size)
        return max(total / count, 1e-300)

    @cached_property
    def track(self) -> tuple[Array, Array]:
        """Times [s] and delays [samples] of segments against the excitation."""
        excitation = self.reference.excitation
        rate = excitation.sample_rate
        latency = self.reference.clock.latency
        size = max(round(SEGMENT_S * rate), 64)
        far = round(FARTHEST_S * rate)
        turns = excitation.frequencies / rate
        delay = np.exp(-2j * np.pi * latency * turns)
        model = excitation.inverse(self.reference.played * delay)
        times, delays = [], []
        low, high = excitation.band
        edges = np.array([max(LOWEST_HZ, 1.2 * low), 0.8 * high])
        start, stop = excitation.time_played(edges) * rate + latency
        first = max(round(start), 0)
        last = min(round(stop), self.samples.size) - size
        for at in range(first, last, size // 2):
            lag = _segment_lag(self.samples[at : at + size], model, at, far)
            if np.isfinite(lag):
                times.append((at + size / 2) / rate)
                delays.append(lag)
        return np.array(times), np.array(delays)

    @property
    def _rate(self) -> float:
        return self.reference.excitation.sample_rate

    def _frequency(self, time: float) -> float:
        """Return what the excitation plays at a time of the recording, Hz."""
        excitation = self.reference.excitation
        grid = np.geomspace(*excitation.band, 400)
        played = (
            excitation.time_played(grid) + self.reference.clock.latency / self._rate
        )
        return float(np.interp(time, played, grid))

    @cached_property
    def slip(self) -> Slip | None:
        """The largest lasting change of delay of half a sample or more."""
        times, delays = self.track
        if delays.size < 8:
            return None
        # A filter bends delays slowly; a slip is a step between neighbours.
        windows = np.median(np.lib.stride_tricks.sliding_window_view(delays, 3), axis=1)
        step = windows[4:] - windows[:-4]
        index = np.arange(step.size)
        before, after = np.maximum(index - 4, 0), np.minimum(index + 4, step.size - 1)
        around = (step[before] + step[after]) / 2
        sharp = step - around
        at = int(np.argmax(np.abs(sharp)))
        turn = 2 * np.pi * self._frequency(times[at + 3]) / self._rate
        noise = 1.5 * float(np.median(np.abs(np.diff(delays))))
        lasting = np.median(delays[at + 4 :]) - np.median(delays[: at + 3])
        if abs(sharp[at]) < max(SMALLEST_SLIP, 6 * noise, SMALLEST_TURN / turn):
            return None
        if abs(lasting) < 0.5 * abs(sharp[at]):
            return None
        return Slip(float(sharp[at]), float(times[at + 3]))


def _segment_lag(segment: Array, model: Array, at: int, far: int) -> float:
    size = segment.size
    low = at - far
    around = np.take(model, np.arange(low, at + size + far), mode="wrap")
    n = 1 << int(np.ceil(np.log2(around.size)))
    spectrum = np.fft.rfft(around, n)
    product = np.conj(np.fft.rfft(segment * np.hanning(size), n)) * spectrum
    match = np.fft.irfft(product, n)[: 2 * far + 1]
    peak = int(np.argmax(match))
    if not 0 < peak < 2 * far or match[peak] <= 0:
        return np.nan
    left, top, right = match[peak - 1 : peak + 2]
    bend = left - 2 * top + right
    part = 0.0 if bend >= 0 else 0.5 * (left - right) / bend
    return far - (peak + part)
