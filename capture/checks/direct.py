"""The direct sound against the geometry."""

from collections.abc import Iterator

import numpy as np

from capture.checks.evidence import Evidence
from capture.checks.finding import Finding
from capture.checks.table import CHECKS

__all__ = ["check_direct"]


EARLY_SAMPLES = 4.5
"""A pulse of a limited band rises by so many samples before its peak."""


@CHECKS.add("direct")
def check_direct(take: Evidence) -> Iterator[Finding]:
    """Mark takes whose direct sound comes at another time than the poses say."""
    onset = take.onset / take.sample_rate
    take.figures["onset_samples"] = [
        float(value) if np.isfinite(value) else None for value in take.onset
    ]
    if take.direct_delay is None:
        return
    expected = np.broadcast_to(np.asarray(take.direct_delay, dtype=float), onset.shape)
    off = onset - expected
    take.figures["direct_off_ms"] = [
        round(1e3 * float(value), 4) if np.isfinite(value) else None for value in off
    ]
    limit = max(take.limits.direct_s, EARLY_SAMPLES / take.sample_rate)
    for channel in np.flatnonzero(np.abs(off) > limit):
        yield Finding(
            "direct_time",
            False,
            f"channel {channel}: the direct sound comes {1e3 * off[channel]:+.2f} ms "
            "off the time that the poses say: were the stands swapped, or moved?",
            float(off[channel]),
            limit,
            "s",
            int(channel),
        )
