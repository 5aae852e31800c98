"""Clocks that run apart."""

from collections.abc import Iterator

import numpy as np

from capture.checks.evidence import Evidence
from capture.checks.finding import Finding
from capture.checks.table import CHECKS

__all__ = ["check_drift"]


@CHECKS.add("drift")
def check_drift(take: Evidence) -> Iterator[Finding]:
    """Mark a drift of the recorder's clock; the response is corrected for it.

    On one interface any drift means a wrong set-up; a session treats it so. Against
    the golden loopback a tenth of a ppm counts; without one, a converter's own phase
    can pose as a ppm or two.
    """
    clock = take.reference.clock
    if not np.isfinite(clock.latency) or take.swapped:
        return
    drift, limit = 1e6 * clock.drift, take.limits.drift_alone_ppm
    if take.golden is not None:
        drift -= 1e6 * take.golden.clock.drift
        limit = take.limits.drift_ppm
    limit = max(limit, 6e6 * clock.drift_sigma)
    if not (clock.runs_off or take.golden):
        limit = np.inf
    take.figures["drift_ppm"] = round(1e6 * float(clock.drift), 4)
    take.figures["drift_sigma_ppm"] = round(1e6 * float(clock.drift_sigma), 4)
    if abs(drift) > limit:
        yield Finding(
            "clock_drift",
            False,
            f"the recorder's clock runs off by {drift:+.2f} ppm (corrected): two "
            "devices, or a wrong clock source",
            drift,
            limit,
            "ppm",
        )
