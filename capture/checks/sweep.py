"""Whether it is the sweep that was recorded."""

from collections.abc import Iterator

import numpy as np

from capture.checks.evidence import Evidence
from capture.checks.finding import Finding
from capture.checks.table import CHECKS

__all__ = ["check_sweep"]

LOWEST_HZ = 120.0  # lower octaves build up late in rooms
FOUND_DB = 6.0  # over the median: noise alone stays below
ONSET_SHARE = 0.1  # -10 dB: early enough, and above the noise of octaves used
FEWEST = 4  # octaves for a line and its misfit
CLEAR_DB = 18.0  # of an octave that tells its onset: noise cannot pose as it
SPAN_S = 0.045  # octaves of a room begin within some 10 ms blocks
STRAIGHT = 0.3  # of the span: a wrong rate makes a line, a room does not


@CHECKS.add("sweep")
def check_sweep(take: Evidence) -> Iterator[Finding]:
    """Refuse takes without the sweep, or with it at another rate.

    In a room all octaves begin together; from a sweep played or recorded at another
    rate they begin one after the other.
    """
    energies = take.energies
    valid = energies.valid
    masked = np.where(valid, energies.energy, 0.0)
    smooth = masked + np.roll(masked, 1, axis=-1)
    peak = smooth.max(axis=-1)
    middle = _median(energies.energy, valid)
    ratio = 10 * np.log10(np.maximum(peak / np.maximum(2 * middle, 1e-300), 1e-30))
    take.figures["prominence_db"] = np.round(ratio.max(axis=-1), 1).tolist()
    for channel in np.flatnonzero(take.finite & (take.peaks > 0)):
        if ratio[channel].max() < FOUND_DB:
            yield Finding(
                "no_sweep",
                True,
                f"channel {channel} does not hold the sweep: nothing stands out by "
                f"{FOUND_DB:.0f} dB",
                float(ratio[channel].max()),
                FOUND_DB,
                "dB",
                int(channel),
            )
            continue
        yield from _rate(take, int(channel), masked[channel], ratio[channel])


def _rate(
    take: Evidence, channel: int, energy: np.ndarray, ratio: np.ndarray
) -> Iterator[Finding]:
    excitation = take.reference.excitation
    lags, centers = take.energies.lags, take.energies.centers
    use = (centers >= LOWEST_HZ) & (ratio > CLEAR_DB)
    if np.count_nonzero(use) < FEWEST or not excitation.rate:
        return
    order = np.argsort(lags)
    rows = energy[use][:, order]
    first = np.argmax(rows >= ONSET_SHARE * rows.max(axis=1, keepdims=True), axis=1)
    onset = lags[order][first]
    logs = np.log(centers[use])
    slope, start = np.polyfit(logs, onset, 1)
    span = abs(slope) * np.ptp(logs)
    off = float(np.abs(onset - slope * logs - start).max())
    if span > max(SPAN_S, 0.004 * excitation.n_played / excitation.sample_rate) and (
        off < STRAIGHT * span
    ):
        rate = 1 / (1 + slope / excitation.rate) if slope > -excitation.rate else np.nan
        yield Finding(
            "wrong_rate",
            True,
            f"channel {channel} holds the sweep at {rate:.3f} times its rate: check "
            "the sample rates of player and recorder, and the excitation",
            float(rate),
            1.0,
            "",
            channel,
        )


def _median(energy: np.ndarray, valid: np.ndarray) -> np.ndarray:
    result = np.empty(energy.shape[:2])
    for octave in range(energy.shape[1]):
        known = energy[:, octave, valid[octave]]
        result[:, octave] = np.median(known, axis=-1) if known.size else 0.0
    return result
