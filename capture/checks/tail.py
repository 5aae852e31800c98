"""Decays that outlast the recording."""

from collections.abc import Iterator

import numpy as np

from capture.checks.table import CHECKS
from capture.evidence import Evidence
from capture.verdict import Verdict

__all__ = ["check_tail"]

ABOVE_NOISE_DB = 10.0


@CHECKS.add("tail")
def check_tail(take: Evidence) -> Iterator[Verdict]:
    """Refuse takes whose recording ends while the highest octaves still sound.

    Those were excited last. Their decay is followed to the end of the recording and
    continued beyond it.
    """
    energies, noise = take.energies, take.noise
    end = take.recording.shape[1] / take.sample_rate - take.latency / take.sample_rate
    played = take.reference.excitation.time_played(energies.centers)
    room = end - played - 0.35 * abs(take.reference.excitation.rate)
    block = energies.octaves.block_s
    lost = np.zeros(take.signal.shape)
    for octave in range(energies.centers.size):
        last = np.flatnonzero(
            (energies.lags > room[octave] - 0.04) & (energies.lags < room[octave])
        )
        if room[octave] < 0.02 or last.size < 2:
            continue
        level = energies.energy[:, octave, last].mean(axis=-1)
        floor = noise.before[:, octave]
        floor = np.where(np.isfinite(floor), floor, 0.0)
        decay = _decay(energies.energy[:, octave], energies.lags, room[octave])
        rest = np.maximum(level - floor, 0) * np.maximum(decay, 0) / block
        lost[:, octave] = np.where(level > 10 ** (ABOVE_NOISE_DB / 10) * floor, rest, 0)
    share = 10 * np.log10(
        lost.sum(axis=1) / np.maximum(take.signal.sum(axis=1), 1e-300) + 1e-30
    )
    take.figures["lost_tail_db"] = [round(float(value), 1) for value in share]
    for channel in np.flatnonzero(share > take.limits.lost_tail_db):
        if take.finite[channel]:
            yield Verdict(
                "tail_cut",
                True,
                f"channel {channel} still sounds when the recording ends "
                f"({share[channel]:.0f} dB of the response are lost): record longer",
                float(share[channel]),
                take.limits.lost_tail_db,
                "dB",
                int(channel),
            )


def _decay(energy: np.ndarray, lags: np.ndarray, room: float) -> np.ndarray:
    """Return the time constant of the second half of the known decay, s.

    What does not fall is noise, and no decay: its constant is 0.
    """
    inside = np.flatnonzero((lags > room / 2) & (lags < room))
    if inside.size < 4:
        inside = np.flatnonzero((lags > 0) & (lags < room))
    if inside.size < 4:
        return np.full(len(energy), 0.05)
    x = lags[inside] - lags[inside].mean()
    y = np.log(np.maximum(energy[:, inside], 1e-300))
    slope = (y * x).sum(axis=1) / (x * x).sum()
    noise = np.sqrt(1.0 / (x * x).sum())
    falls = slope < -3 * noise
    return np.where(falls, -1 / np.where(falls, slope, -1.0), 0.0)
