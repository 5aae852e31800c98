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
    spike = max(round(SPIKE_S * take.sample_rate), 2)
    pre = take.reference.excitation.pre
    energy = take.response**2
    total = energy.sum(axis=1)
    zero = slice(max(pre - spike, 0), pre + spike)
    later = energy[:, pre + round(CLEAR_S * take.sample_rate) :].max(axis=1, initial=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        level = 10 * np.log10(energy[:, zero].max(axis=1, initial=0) / later + 1e-30)
    # A stronger "copy" is a direct sound without flight time, as in a test by cable.
    level = np.where(level < 0, level, np.nan)
    peak = np.argmax(energy, axis=1)
    near = np.array(
        [
            row[max(at - spike, 0) : at + spike].sum()
            for row, at in zip(energy, peak, strict=True)
        ]
    )
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
