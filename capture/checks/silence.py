"""Channels that carry nothing."""

from collections.abc import Iterator

import numpy as np

from capture.checks.evidence import Evidence
from capture.checks.finding import Finding
from capture.checks.table import CHECKS

__all__ = ["check_silence"]


@CHECKS.add("silence")
def check_silence(take: Evidence) -> Iterator[Finding]:
    """Refuse channels that are constant, and a loopback that is."""
    spread = np.ptp(take.recording, axis=1)
    take.figures["peak_dbfs"] = [
        round(20 * float(np.log10(max(peak, 1e-30))), 2) for peak in take.peaks
    ]
    for channel in np.flatnonzero((spread == 0) & take.finite):
        yield Finding(
            "silent_channel",
            True,
            f"channel {channel} is silent: check the microphone and its cable",
            channel=int(channel),
        )
    loopback = take.reference.loopback
    if loopback is not None and np.ptp(loopback) == 0:
        yield Finding(
            "silent_loopback",
            True,
            "the loopback is silent: check its cable; the played signal was used",
        )
