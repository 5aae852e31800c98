"""Recordings that begin too late or end too soon."""

from collections.abc import Iterator

import numpy as np

from capture.checks.table import CHECKS
from capture.evidence import Evidence
from capture.verdict import Verdict

__all__ = ["check_beginning"]

EARLY_S = 0.02


@CHECKS.add("beginning")
def check_beginning(take: Evidence) -> Iterator[Verdict]:
    """Refuse takes that do not hold the whole sweep."""
    excitation = take.reference.excitation
    latency = take.reference.clock.latency
    missing = take.latency + excitation.n_played - take.recording.shape[1]
    if missing > 0.002 * take.sample_rate:
        yield Verdict(
            "short_recording",
            True,
            f"the recording ends {missing / take.sample_rate:.3f} s before the sweep "
            "does: record longer",
            missing / take.sample_rate,
            0.0,
            "s",
        )
    if np.isfinite(latency) and latency < -1:
        yield _missing(-latency / take.sample_rate, None)
        return
    if np.isfinite(latency):
        return
    power = take.energies.energy.sum(axis=1)
    peak = take.energies.lags[np.argmax(power, axis=1)]
    for channel in np.flatnonzero(peak < -EARLY_S):
        if take.finite[channel]:
            yield _missing(-float(peak[channel]), int(channel))


def _missing(seconds: float, channel: int | None) -> Verdict:
    return Verdict(
        "missing_start",
        True,
        f"the recording begins {seconds:.3f} s after the sweep did",
        seconds,
        0.0,
        "s",
        channel,
    )
