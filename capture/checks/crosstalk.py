"""Electrical copies of the output in a microphone channel, and swapped cables."""

from collections.abc import Iterator

import numpy as np

from capture.checks.table import CHECKS
from capture.evidence import Evidence
from capture.verdict import Verdict

__all__ = ["check_crosstalk"]

SPIKE_S = 0.0005
CLEAR_S = 0.002
CABLE_SHARE = 0.98


@CHECKS.add("crosstalk")
def check_crosstalk(take: Evidence) -> Iterator[Verdict]:
    """Mark a spike at time zero; refuse a microphone channel that is the cable."""
    if take.cable is None:
        return
    excitation = take.reference.excitation
    spike = max(round(SPIKE_S * take.sample_rate), 2)
    pre = excitation.pre
    energy = take.response**2
    total = energy.sum(axis=1)
    start = max(pre - spike, 0)
    near = energy[:, start : pre + spike].sum(axis=1)
    direct = np.where(
        take.onset > CLEAR_S * take.sample_rate, energy.max(axis=1), np.nan
    )
    top = energy[:, start : pre + spike].max(axis=1, initial=0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        level = 10 * np.log10(top / direct + 1e-30)
    take.figures["crosstalk_db"] = [
        round(float(value), 1) if np.isfinite(value) else None for value in level
    ]
    for channel in np.flatnonzero(take.finite & (total > 0)):
        if near[channel] > CABLE_SHARE * total[channel] and (
            take.cable.compactness < near[channel] / total[channel]
        ):
            yield Verdict(
                "swapped_channels",
                True,
                f"channel {channel} carries the output by cable and the loopback "
                "does not: are the two swapped?",
                channel=int(channel),
            )
        elif level[channel] > take.limits.crosstalk_db:
            yield Verdict(
                "crosstalk",
                False,
                f"channel {channel} has a copy of the output at time zero, "
                f"{level[channel]:.0f} dB relative to the direct sound",
                float(level[channel]),
                take.limits.crosstalk_db,
                "dB",
                int(channel),
            )
