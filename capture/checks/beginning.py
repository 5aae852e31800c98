"""Recordings that begin too late or end too soon."""

from collections.abc import Iterator
from importlib import import_module
from typing import Any

import numpy as np

from capture.checks.evidence import Evidence
from capture.checks.finding import Finding
from capture.checks.table import CHECKS

__all__ = ["check_beginning", "check_ending"]

EARLY_S = 0.02  # two blocks of lags: where a response begins is known to one
EARLY_SAMPLES = 3  # a drifting clock moves the fitted latency by less
DROP_DB = 12.0  # per twelfth of an octave: steeper than any box or filter
WEAK_SHARE = 0.1  # highest octave 10 dB below the strongest: else it did sound


@CHECKS.add("beginning")
def check_beginning(take: Evidence) -> Iterator[Finding]:
    """Refuse takes that do not hold the whole sweep."""
    excitation = take.reference.excitation
    latency = take.reference.clock.latency
    missing = take.latency + excitation.n_played - take.recording.shape[1]
    if missing > 0.002 * take.sample_rate:
        yield Finding(
            "short_recording",
            True,
            f"the recording ends {missing / take.sample_rate:.3f} s before the sweep "
            "does: record longer",
            missing / take.sample_rate,
            0.0,
            "s",
        )
    slipped = take.cable is not None and take.cable.slip is not None
    if np.isfinite(latency) and latency < -EARLY_SAMPLES and not slipped:
        yield _missing(-latency / take.sample_rate, None)
        return
    if np.isfinite(latency):
        return
    power = take.energies.energy.sum(axis=1)
    peak = take.energies.lags[np.argmax(power, axis=1)]
    for channel in np.flatnonzero(peak < -EARLY_S):
        if take.finite[channel]:
            yield _missing(-float(peak[channel]), int(channel))


@CHECKS.add("ending")
def check_ending(take: Evidence) -> Iterator[Finding]:
    """Refuse takes in which the sweep stops before its end.

    The response then ends sharply at the frequency played last; a loudspeaker's
    own limit is not as sharp.
    """
    excitation = take.reference.excitation
    low, high = excitation.band
    edges = np.geomspace(low, high, max(int(12 * np.log2(high / low)), 8))
    size = 2 * take.response.shape[1]
    index = np.searchsorted(np.fft.rfftfreq(size, 1 / take.sample_rate), edges)
    if np.any(np.diff(index) < 2):
        keep = np.concatenate(([True], np.diff(index) >= 2))
        edges, index = edges[keep], index[keep]
    if edges.size < 8:
        return
    fft: Any = import_module("scipy.fft")
    weak = take.signal[:, -1] < WEAK_SHARE * take.signal.max(axis=1)
    for channel in np.flatnonzero(take.finite & (take.peaks > 0) & weak):
        spectrum = fft.rfft(take.response[channel], size)
        power = spectrum.real**2 + spectrum.imag**2
        sums = np.add.reduceat(power[: index[-1]], index[:-1]) / np.diff(index)
        level = 10 * np.log10(sums + 1e-300)
        drop = np.array(
            [
                level[at - 4 : at - 1].mean() - level[at + 1 : at + 4].max()
                for at in range(4, level.size - 6)
            ]
        )
        if not drop.size or drop.max() < DROP_DB:
            continue
        at = int(np.argmax(drop)) + 4
        rest = level[at + 1 :]
        if level[:at].mean() - rest.max() < DROP_DB:
            continue
        stop = edges[at : at + 1]
        time = float(excitation.time_played(stop)[0]) + take.latency / take.sample_rate
        yield Finding(
            "stops_early",
            True,
            f"channel {channel}: the sweep stops at {edges[at]:.0f} Hz, {time:.3f} s",
            float(drop.max()),
            DROP_DB,
            "dB",
            int(channel),
        )


def _missing(seconds: float, channel: int | None) -> Finding:
    return Finding(
        "missing_start",
        True,
        f"the recording begins {seconds:.3f} s after the sweep did",
        seconds,
        0.0,
        "s",
        channel,
    )
