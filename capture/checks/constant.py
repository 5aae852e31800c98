"""A constant part."""

from collections.abc import Iterator

import numpy as np

from capture.checks.evidence import Evidence
from capture.checks.finding import Finding
from capture.checks.hum import quiet_part
from capture.checks.table import CHECKS

__all__ = ["check_constant"]

BLOCK_S = 0.02
"""One period of the mains at 50 Hz: hum is no constant."""
FEWEST = 4  # blocks: fewer give no standard error worth the name
SIGMAS = 6.0  # with few blocks the error itself is off by half: 6, not 3


@CHECKS.add("constant")
def check_constant(take: Evidence) -> Iterator[Finding]:
    """Mark channels with a constant part; the response is free of it.

    Looked for in the quiet part of the recording: a sweep that begins at a low
    frequency has a mean of its own.
    """
    means, sigmas = _constants(take)
    levels = 20 * np.log10(np.maximum(means, 1e-30))
    take.figures["dc_dbfs"] = [round(float(level), 1) for level in levels]
    for channel in np.flatnonzero(
        (levels > take.limits.dc_dbfs) & (means > SIGMAS * sigmas)
    ):
        yield Finding(
            "dc_offset",
            False,
            f"channel {channel} has a constant part of {levels[channel]:.1f} dBFS",
            float(levels[channel]),
            take.limits.dc_dbfs,
            "dBFS",
            int(channel),
        )


def _constants(take: Evidence) -> tuple[np.ndarray, np.ndarray]:
    """Return the constant part of each channel and its standard error."""
    size = max(round(BLOCK_S * take.sample_rate), 1)
    quiet = quiet_part(take)
    count = quiet.shape[1] // size
    if count < FEWEST:
        # The whole take, whose sweep may hide a hundredth of its peak.
        return np.abs(take.recording.mean(axis=1)), 0.01 / SIGMAS * take.peaks
    means = quiet[:, : count * size].reshape(-1, count, size).mean(axis=2)
    errors = means.std(axis=1, ddof=1) / np.sqrt(count)
    return np.abs(means.mean(axis=1)), errors
