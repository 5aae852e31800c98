"""Harmonics of the loudspeaker."""

from collections.abc import Iterator

import numpy as np

from capture.checks.table import CHECKS
from capture.evidence import Evidence
from capture.verdict import Verdict

__all__ = ["check_distortion"]

LOWEST_HZ = 200.0
ORDERS = (2, 3, 4, 5)
AFTER_S = 0.1
BEFORE_S = 0.01
NEAREST_S = 0.12
"""The second harmonic must lead by more than the early sound lasts."""
ABOVE_NOISE = 4.0


@CHECKS.add("distortion")
def check_distortion(take: Evidence) -> Iterator[Verdict]:
    """Measure harmonics by their responses, which stand before the linear one.

    References
    ----------
    Farina, AES 108 (2000): order k leads by L ln k.
    """
    share = harmonic_share(take)
    take.figures["thd_percent"] = [round(100 * float(value), 3) for value in share]
    for channel in np.flatnonzero(100 * share > take.limits.distortion_percent):
        percent = 100 * float(share[channel])
        hard = percent > take.limits.spoiling_distortion_percent
        yield Verdict(
            "distortion",
            hard,
            f"channel {channel} holds {percent:.1f} % harmonics: play more softly",
            percent,
            take.limits.distortion_percent,
            "%",
            int(channel),
        )


def harmonic_share(take: Evidence) -> np.ndarray:
    """Return amplitudes of harmonics over the linear response, per channel."""
    rate = take.reference.excitation.rate
    if rate * np.log(2) < NEAREST_S:
        return np.full(len(take.recording), np.nan)
    floor = take.noise.before
    floor = np.where(np.isfinite(floor), floor, take.noise.floor)
    return np.array(
        [
            _share(take, channel, floor[channel])
            for channel in range(len(take.recording))
        ]
    )


def _share(take: Evidence, channel: int, floor: np.ndarray) -> float:
    energies, rate = take.energies, take.reference.excitation.rate
    energy, valid = energies.energy[channel], energies.valid()
    lags = energies.lags - take.start[channel]
    total = 0.0
    for order in ORDERS:
        lead = rate * np.log(order)
        room = min(AFTER_S, rate * np.log(order / (order - 1)) - BEFORE_S)
        window = (lags > -lead - BEFORE_S) & (lags < -lead + room)
        linear = (lags > -BEFORE_S) & (lags < room)
        use = (energies.centers > LOWEST_HZ) & (
            energies.centers > 1.5 * order * take.reference.excitation.band[0]
        )
        ratios = []
        for octave in np.flatnonzero(use):
            inside = window & valid[octave]
            noise = floor[octave] * np.count_nonzero(inside)
            found, base = energy[octave, inside].sum(), energy[octave, linear].sum()
            if np.any(inside) and base > 0:
                clear = found > ABOVE_NOISE * noise
                ratios.append((found - noise) / base if clear else 0.0)
        total += float(np.median(ratios)) if ratios else 0.0
    return float(np.sqrt(min(max(total, 0.0), 1.0)))
