"""Harmonics of the loudspeaker."""

from collections.abc import Iterator

import numpy as np

from capture.checks.evidence import Evidence
from capture.checks.finding import Finding
from capture.checks.table import CHECKS

__all__ = ["check_distortion"]

LOWEST_HZ = 200.0  # below, decays of rooms run into the next harmonic
ORDERS = (2, 3, 4, 5)  # a loudspeaker's higher ones lie below its noise
AFTER_S = 0.1  # early decay holds nearly all of a harmonic's energy
BEFORE_S = 0.01  # one block: a harmonic's start is known no finer
NEAREST_S = 0.12
"""The second harmonic must lead by more than the early sound lasts."""
ABOVE_NOISE = 4.0  # 6 dB: block energies of few freedoms scatter by half that


@CHECKS.add("distortion")
def check_distortion(take: Evidence) -> Iterator[Finding]:
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
        yield Finding(
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
    total = np.zeros(len(take.recording))
    # Channels of one start share their windows: an array has few of them.
    for start in np.unique(take.start):
        rows = np.flatnonzero(take.start == start)
        for order in ORDERS:
            total[rows] += _share(take, order, rows, float(start), floor[rows])
    return np.sqrt(np.clip(total, 0.0, 1.0))


def _share(
    take: Evidence, order: int, rows: np.ndarray, start: float, floor: np.ndarray
) -> np.ndarray:
    """Return the energy of one harmonic over the linear response, per channel."""
    energies, rate = take.energies, take.reference.excitation.rate
    lags = energies.lags - start
    lead = rate * np.log(order)
    room = min(AFTER_S, rate * np.log(order / (order - 1)) - BEFORE_S)
    window = np.flatnonzero((lags > -lead - BEFORE_S) & (lags < -lead + room))
    linear = np.flatnonzero((lags > -BEFORE_S) & (lags < room))
    use = (energies.centers > LOWEST_HZ) & (
        energies.centers > 1.5 * order * take.reference.excitation.band[0]
    )
    inside = energies.valid[:, window] & use[:, np.newaxis]
    count = np.count_nonzero(inside, axis=1)
    energy = energies.energy[rows]
    found = np.where(inside, energy[:, :, window], 0.0).sum(axis=-1)
    base = energy[:, :, linear].sum(axis=-1)
    noise = floor * count
    usable = (count > 0) & (base > 0)
    ratios = np.where(found > ABOVE_NOISE * noise, found - noise, 0.0)
    ratios /= np.where(base > 0, base, 1.0)
    return np.array(
        [
            np.median(row[good]) if np.any(good) else 0.0
            for row, good in zip(ratios, usable, strict=True)
        ]
    )
