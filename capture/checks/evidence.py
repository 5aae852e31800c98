"""All that the checks of one take look at."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.checks.cable import Cable
from capture.checks.finding import TakeLimits
from capture.checks.noise_floor import NoiseFigures, estimate_noise
from capture.signal.crests import Crests
from capture.signal.energy import EnergyMap
from capture.signal.reference import SweepReference
from capture.signal.residual import Residual
from rir.onset import find_onset

__all__ = ["Evidence"]

Array = NDArray[np.float64]

CABLE_SHARE = 0.98  # a cable has all but its noise within 5 ms; no room has


@dataclass(eq=False)
class Evidence:
    """One take, deconvolved."""

    recording: Array
    """What was recorded; channels that are not finite are zero here. Shape (channels,
    n)."""
    finite: NDArray[np.bool_]
    """Which channels are finite. Shape (channels,)."""
    response: Array
    """The responses. Shape (channels, pre + length)."""
    reference: SweepReference
    """What was divided by."""
    energies: EnergyMap
    """Energy by octave and lag."""
    residual: Residual
    """Unexplained sound per group of channels."""
    groups: list[list[int]]
    """Channels of each group."""
    crests: Crests | None
    """Extremes against prediction; None for arrays of many channels."""
    golden: SweepReference | None
    """The reference of the golden loopback."""
    direct_delay: Array | None
    """Expected direct sound per channel, s."""
    limits: TakeLimits
    """What is tolerated."""
    figures: dict[str, Any] = field(default_factory=dict)
    """Where checks put their numbers."""

    @property
    def sample_rate(self) -> float:
        """Sampling rate, Hz."""
        return self.reference.excitation.sample_rate

    @property
    def latency(self) -> float:
        """Samples before the emission; 0 when no loopback tells it."""
        latency = self.reference.clock.latency
        return latency if np.isfinite(latency) else 0.0

    @cached_property
    def noise(self) -> NoiseFigures:
        """Noise per channel and octave."""
        return estimate_noise(self.energies)

    @cached_property
    def cable(self) -> Cable | None:
        """The loopback, if there is a usable one."""
        if self.reference.loopback is None:
            return None
        if not np.isfinite(self.reference.clock.latency):
            return None
        return Cable(self.reference)

    @cached_property
    def swapped(self) -> list[int]:
        """Channels that are a cable while the loopback is none."""
        cable = self.cable
        if cable is None or cable.compactness > CABLE_SHARE:
            return []
        return [
            channel
            for channel, row in enumerate(self.recording)
            if cable.compactness_of(row) > CABLE_SHARE
        ]

    @cached_property
    def peaks(self) -> Array:
        """Largest magnitude per channel."""
        return np.maximum(self.recording.max(axis=1), -self.recording.min(axis=1))

    @cached_property
    def kept(self) -> NDArray[np.bool_]:
        """Blocks of lags that the response keeps, shape (blocks,)."""
        excitation = self.reference.excitation
        lags = self.energies.lags
        low = -max(excitation.pre / self.sample_rate, 0.02)
        return (lags > low) & (lags < excitation.length / self.sample_rate)

    @cached_property
    def signal(self) -> Array:
        """Energy of the response without noise, shape (channels, octaves)."""
        kept = self.kept & self.energies.valid
        total = np.where(kept, self.energies.energy, 0).sum(axis=-1)
        expected = self.noise.floor * kept.sum(axis=-1)
        return np.maximum(total - expected, 0.0)

    @cached_property
    def onset(self) -> Array:
        """First sample at -20 dB below the peak, per channel; NaN if silent."""
        first = find_onset(self.response) - float(self.reference.excitation.pre)
        return np.where(self.response.any(axis=1), first, np.nan)

    @cached_property
    def start(self) -> Array:
        """Lag of the first block within 10 dB of the loudest, per channel, s."""
        order = np.argsort(self.energies.lags)
        power = self.energies.energy.sum(axis=1)[:, order]
        return self.energies.lags[order][find_onset(power)]

    def seconds(self, sample: float) -> str:
        """Return a place in the recording for a person."""
        return f"{sample / self.sample_rate:.3f} s"
