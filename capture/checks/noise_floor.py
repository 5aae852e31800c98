"""Noise of a response by three estimates: before, after, and by Lundeby's zoom."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.signal.energy import EnergyMap

__all__ = ["NoiseFigures", "estimate_noise"]

Array = NDArray[np.float64]

ROUNDS = 6  # Lundeby: five are enough; one to spare
MARGIN_DB = 10.0  # Lundeby: 5 to 10 dB above the noise
# Median over mean of block energies with few degrees of freedom.
MEDIAN_SHARE = 0.9


@dataclass(frozen=True, eq=False)
class NoiseFigures:
    """Noise energy per block, each shape (channels, octaves); NaN where unknown."""

    before: Array
    """From lags before the emission: the recording's pre-roll."""
    after: Array
    """From lags after the decay."""
    crossing: Array
    """Lundeby's: beyond the point where decay and noise meet."""
    knee: Array
    """Where they meet, s."""
    decay: Array
    """Time in which the energy falls by e, s; NaN if nothing decays."""

    @property
    def floor(self) -> Array:
        """The noise to count with: the late one, or what is known; 0 if nothing."""
        stack = np.stack((self.crossing, self.after, self.before))
        known = np.where(np.isfinite(stack), stack, np.inf)
        lowest = known.min(axis=0)
        return np.where(np.isfinite(lowest), lowest, 0.0)


def estimate_noise(energies: EnergyMap) -> NoiseFigures:
    """Estimate the noise of every channel and octave.

    Parameters
    ----------
    energies : EnergyMap
        Energy by octave and lag.

    References
    ----------
    Lundeby, Vigran, Bietz, Vorländer, Acustica 81 (1995).
    """
    valid, lags = energies.valid, energies.lags
    positive = valid & (lags > 0)
    crossing, knee, decay = _zoom(energies, positive)
    after = np.full_like(crossing, np.nan)
    before = np.full_like(crossing, np.nan)
    played = energies.octaves.excitation.time_played(energies.centers)
    rate = energies.octaves.excitation.sample_rate
    pre_roll = energies.latency / rate if np.isfinite(energies.latency) else 0.0
    for octave in range(energies.centers.size):
        at = lags + played[octave]
        early = valid[octave] & (at > -pre_roll) & (at < -0.02) & (lags < -0.06)
        late = np.flatnonzero(positive[octave])
        late = late[int(0.7 * late.size) :]
        if np.count_nonzero(early) >= 4:
            before[:, octave] = energies.energy[:, octave, early].mean(axis=-1)
        if late.size >= 4:
            after[:, octave] = np.median(energies.energy[:, octave, late], axis=-1)
    return NoiseFigures(before, after / MEDIAN_SHARE, crossing, knee, decay)


def _zoom(
    energies: EnergyMap, positive: NDArray[np.bool_]
) -> tuple[Array, Array, Array]:
    channels, octaves, _ = energies.energy.shape
    block = energies.octaves.block_s
    noise = np.full((channels, octaves), np.nan)
    knee = np.full_like(noise, np.nan)
    decay = np.full_like(noise, np.nan)
    for octave in range(octaves):
        order = np.flatnonzero(positive[octave])
        if order.size < 12:
            continue
        rows = np.maximum(energies.energy[:, octave, order], 1e-300)
        found = _zoom_octave(rows, block)
        noise[:, octave], knee[:, octave], decay[:, octave] = found
    return noise, knee, decay


def _zoom_octave(rows: Array, block: float) -> tuple[Array, Array, Array]:
    count = rows.shape[1]
    index = np.arange(count)
    levels = 10 * np.log10((rows + np.roll(rows, 1, axis=1)) / 2)
    levels[:, 0] = 10 * np.log10(rows[:, 0])
    peak = np.argmax(levels[:, : max(count // 2, 4)], axis=1)
    top = levels[np.arange(len(rows)), peak]
    noise = rows[:, -max(count // 10, 4) :].mean(axis=1)
    slope = np.full(len(rows), np.nan)
    cross = np.full(len(rows), float(count))
    for _ in range(ROUNDS):
        floor = 10 * np.log10(noise)
        below = levels < (floor + MARGIN_DB)[:, np.newaxis]
        below &= index > peak[:, np.newaxis]
        end = np.where(below.any(axis=1), below.argmax(axis=1), count)
        weight = (index >= peak[:, np.newaxis]) & (index < end[:, np.newaxis])
        slope, start = _line(index, levels, weight)
        with np.errstate(divide="ignore", invalid="ignore"):
            cross = (floor - start) / slope
        usable = (slope < 0) & np.isfinite(cross) & (top > floor + MARGIN_DB)
        slope = np.where(usable, slope, np.nan)
        cross = np.where(usable, np.clip(cross, 0, count), float(count))
        rest = cross + np.where(usable, -MARGIN_DB / np.where(usable, slope, -1), 0)
        first = np.minimum(rest, count - max(count // 10, 4)).astype(int)
        sums = np.concatenate((np.zeros((len(rows), 1)), np.cumsum(rows, axis=1)), 1)
        picked = sums[np.arange(len(rows)), first]
        noise = np.maximum((sums[:, -1] - picked) / (count - first), 1e-300)
    return noise, cross * block, -10 * np.log10(np.e) / slope * block


def _line(
    index: Array, levels: Array, weight: NDArray[np.bool_]
) -> tuple[Array, Array]:
    count = np.maximum(weight.sum(axis=1), 1)
    x = np.where(weight, index, 0).sum(axis=1) / count
    y = np.where(weight, levels, 0).sum(axis=1) / count
    off = np.where(weight, index - x[:, np.newaxis], 0)
    spread = np.maximum((off**2).sum(axis=1), 1e-12)
    slope = (off * np.where(weight, levels, 0)).sum(axis=1) / spread
    slope = np.where(weight.sum(axis=1) >= 3, slope, np.nan)
    return slope, y - slope * x
