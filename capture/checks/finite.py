"""Samples that are no numbers."""

from collections.abc import Iterator

import numpy as np

from capture.checks.evidence import Evidence
from capture.checks.finding import Finding
from capture.checks.table import CHECKS

__all__ = ["check_finite"]


@CHECKS.add("finite")
def check_finite(take: Evidence) -> Iterator[Finding]:
    """Refuse channels with NaN or infinity; their response is NaN."""
    for channel in np.flatnonzero(~take.finite):
        yield Finding(
            "non_finite",
            True,
            f"channel {channel} holds samples that are not finite numbers",
            channel=int(channel),
        )
