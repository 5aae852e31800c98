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
NEAREST_S = 0.05
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
    energies, rate = take.energies, take.reference.excitation.rate
    total = np.zeros(len(take.recording))
    if rate * np.log(2) < NEAREST_S:
        return np.full(len(take.recording), np.nan)
    lags, valid = energies.lags, energies.valid()
    floor = take.noise.before
    late = take.noise.floor
    floor = np.where(np.isfinite(floor), floor, late)
    for order in ORDERS:
        lead = rate * np.log(order)
        room = rate * np.log(order / (order - 1)) - BEFORE_S
        window = (lags > -lead - BEFORE_S) & (lags < -lead + min(AFTER_S, room))
        linear = (lags > -BEFORE_S) & (lags < min(AFTER_S, room))
        use = (energies.centers > LOWEST_HZ) & (
            energies.centers > 1.5 * order * take.reference.excitation.band[0]
        )
        ratios = []
        for octave in np.flatnonzero(use):
            if not np.any(valid[octave] & window):
                continue
            found = energies.energy[:, octave, window & valid[octave]].sum(axis=-1)
            noise = floor[:, octave] * np.count_nonzero(window & valid[octave])
            base = energies.energy[:, octave, linear].sum(axis=-1)
            clear = found > ABOVE_NOISE * noise
            ratio = (found - noise) / np.maximum(base, 1e-300)
            ratios.append(np.where(clear, ratio, 0.0))
        if ratios:
            total += np.median(np.array(ratios), axis=0)
    return np.sqrt(np.minimum(total, 1.0))
