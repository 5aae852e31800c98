"""Impulse to noise ratio per octave, by three estimates."""

from collections.abc import Iterator

import numpy as np

from capture.checks.evidence import Evidence
from capture.checks.finding import Finding
from capture.checks.table import CHECKS

__all__ = ["check_noise"]

LOWEST_HZ, HIGHEST_HZ = 100.0, 10000.0
"""Octaves 125 Hz to 8 kHz, where rooms are judged."""


@CHECKS.add("noise")
def check_noise(take: Evidence) -> Iterator[Finding]:
    """Mark octaves with little range; refuse takes that are all noise.

    References
    ----------
    Hak, Wenmaekers, van Luxemburg, Acustica 98 (2012): T20 needs an impulse to
    noise ratio of 35 dB, T30 45 dB.
    """
    energies, noise = take.energies, take.noise
    smooth = energies.energy + np.roll(energies.energy, 1, axis=-1)
    peak = np.where(take.kept, smooth, 0).max(axis=-1) / 2
    names = {"before": noise.before, "after": noise.after, "lundeby": noise.crossing}
    for name, floor in names.items():
        take.figures[f"inr_{name}_db"] = _table(energies.centers, peak, floor)
    take.figures["inr_db"] = _table(energies.centers, peak, noise.floor)
    blocks = np.count_nonzero(take.kept)
    share = (noise.floor * blocks).sum(axis=1) / np.maximum(
        take.signal.sum(axis=1), 1e-300
    )
    level = 10 * np.log10(share + 1e-30)
    take.figures["noise_in_response_db"] = [round(float(value), 1) for value in level]
    for channel in np.flatnonzero(take.finite & (take.peaks > 0)):
        if level[channel] > take.limits.drowned_db:
            yield Finding(
                "noise",
                True,
                f"channel {channel}: noise is {level[channel]:.0f} dB above the "
                "response",
                float(level[channel]),
                take.limits.drowned_db,
                "dB",
                int(channel),
            )
            continue
        yield from _low_range(take, int(channel), peak[channel])


def _low_range(take: Evidence, channel: int, peak: np.ndarray) -> Iterator[Finding]:
    centers = take.energies.centers
    floor = np.maximum(take.noise.floor[channel], 1e-300)
    ratio = 10 * np.log10(np.maximum(peak, 1e-300) / floor)
    asked = (centers > LOWEST_HZ) & (centers < HIGHEST_HZ)
    low = asked & (ratio < take.limits.low_inr_db)
    if np.any(low):
        names = ", ".join(f"{center:g}" for center in centers[low])
        yield Finding(
            "low_inr",
            False,
            f"channel {channel}: impulse to noise ratio below "
            f"{take.limits.low_inr_db:.0f} dB in the octaves {names} Hz",
            float(ratio[low].min()),
            take.limits.low_inr_db,
            "dB",
            channel,
        )


def _table(
    centers: np.ndarray, peak: np.ndarray, floor: np.ndarray
) -> dict[str, list[float | None]]:
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = 10 * np.log10(peak / floor)
    return {
        f"{center:g}": [
            round(float(value), 1) if np.isfinite(value) else None for value in column
        ]
        for center, column in zip(centers, ratio.T, strict=True)
    }
