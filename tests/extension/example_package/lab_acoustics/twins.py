"""A check: two microphone channels that hold the same samples."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from capture.checks.evidence import Evidence
from capture.checks.finding import Finding


def check_twins(take: Evidence) -> Iterator[Finding]:
    """Refuse takes in which a channel is a copy of another."""
    rows = take.recording
    pairs = [
        (one, other)
        for one, other in combinations(np.flatnonzero(take.finite), 2)
        if np.any(rows[one]) and np.array_equal(rows[one], rows[other])
    ]
    take.figures["twin_channels"] = len(pairs)
    for one, other in pairs:
        text = f"channel {other} is a copy of channel {one}: is it plugged in twice?"
        yield Finding("twin_channels", True, text, channel=int(other))
