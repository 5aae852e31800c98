"""Decays that outlast the recording."""

from collections.abc import Iterator

import numpy as np

from capture.checks.evidence import Evidence
from capture.checks.finding import Finding
from capture.checks.table import CHECKS

__all__ = ["check_tail"]

SIGMAS = 5.0  # good takes of thousands must pass
SHORTEST_S = 0.04  # four blocks: the fewest that carry a slope
FADED_S = 0.15  # shorter records lend their whole decay to the slope
SLACK = 1.2  # block energies scatter a little more than chi-square says
LATE_SHARE = 0.35  # the later third: the early part falls even in good takes
SHALLOWEST = 1.6  # 2 dB: a slope too slight to tell from level noise


@CHECKS.add("tail")
def check_tail(take: Evidence) -> Iterator[Finding]:
    """Refuse takes whose recording ends while the response still sounds.

    The later half of what is known of each octave's decay must be noise; where it
    still falls, the decay is continued beyond the end of the recording.
    """
    energies = take.energies
    end = (take.recording.shape[1] - take.latency) / take.sample_rate
    known = end - take.reference.excitation.time_played(energies.centers)
    room = known - 0.35 * abs(take.reference.excitation.rate)
    room = np.minimum(room, energies.lags.max())
    fall = _common_fall(take, room)
    lost = np.zeros_like(take.signal)
    block = energies.octaves.block_s
    for octave in range(energies.centers.size):
        last = np.flatnonzero(
            (energies.lags > room[octave] - 2.5 * block)
            & (energies.lags < room[octave])
        )
        if room[octave] > SHORTEST_S and last.size:
            level = energies.energy[:, octave, last].mean(axis=-1)
            lost[:, octave] = level / np.maximum(fall * block, 1e-9)
        else:
            decayed = np.exp(-fall * max(known[octave], 0.0))
            lost[:, octave] = take.signal[:, octave] * decayed
    total = np.maximum(take.signal.sum(axis=1), 1e-300)
    level = 10 * np.log10(lost.sum(axis=1) / total + 1e-30)
    share = np.where(fall > 0, level, -300.0)
    take.figures["lost_tail_db"] = [round(float(value), 1) for value in share]
    for channel in np.flatnonzero(share > take.limits.lost_tail_db):
        if take.finite[channel]:
            yield Finding(
                "tail_cut",
                True,
                f"channel {channel} still sounds when the recording ends "
                f"({share[channel]:.0f} dB of the response are lost): record longer",
                float(share[channel]),
                take.limits.lost_tail_db,
                "dB",
                int(channel),
            )


def _common_fall(take: Evidence, room: np.ndarray) -> np.ndarray:
    """Return the rate at which late energy falls in all octaves, 1/s; 0 for none."""
    energies = take.energies
    top = np.zeros(len(take.recording))
    bottom, longest = 0.0, 0.0
    for octave in np.flatnonzero(room > SHORTEST_S):
        lags = energies.lags
        start = max(room[octave] * (1 - LATE_SHARE), 0.01)
        inside = np.flatnonzero((lags > start) & (lags < room[octave]))
        if inside.size < 4 and room[octave] < FADED_S:
            inside = np.flatnonzero((lags > 0.01) & (lags < room[octave]))
        if inside.size < 3:
            continue
        x = lags[inside] - lags[inside].mean()
        y = np.log(np.maximum(energies.energy[:, octave, inside], 1e-300))
        freedom = max(0.7 * energies.centers[octave] * energies.octaves.block_s, 1)
        top += freedom * (y * x).sum(axis=1)
        bottom += freedom * float((x * x).sum())
        longest = max(longest, float(np.ptp(x)))
    if not bottom:
        return top
    slope = top / bottom
    sure = slope < -SIGMAS * SLACK / np.sqrt(bottom)
    deep = -slope * longest > np.log(SHALLOWEST)
    return np.where(sure & deep, -slope, 0.0)
