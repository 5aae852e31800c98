"""A constant part."""

from collections.abc import Iterator

import numpy as np

from capture.checks.table import CHECKS
from capture.evidence import Evidence
from capture.verdict import Verdict

__all__ = ["check_constant"]


@CHECKS.add("constant")
def check_constant(take: Evidence) -> Iterator[Verdict]:
    """Mark channels with a constant part; the response is free of it."""
    means = np.abs(take.recording.mean(axis=1))
    levels = 20 * np.log10(np.maximum(means, 1e-30))
    take.figures["dc_dbfs"] = [round(float(level), 1) for level in levels]
    relative = means / np.maximum(take.peaks, 1e-30)
    for channel in np.flatnonzero((levels > take.limits.dc_dbfs) & (relative > 0.01)):
        yield Verdict(
            "dc_offset",
            False,
            f"channel {channel} has a constant part of {levels[channel]:.1f} dBFS",
            float(levels[channel]),
            take.limits.dc_dbfs,
            "dBFS",
            int(channel),
        )
