"""The loopback against the session's first good one."""

from collections.abc import Iterator

import numpy as np

from capture.checks.evidence import Evidence
from capture.checks.finding import Finding
from capture.checks.table import CHECKS

__all__ = ["check_golden"]

CONTRAST_DB = 12.0  # the loudest of some hundred blocks of noise stays below


@CHECKS.add("golden")
def check_golden(take: Evidence) -> Iterator[Finding]:
    """Refuse takes whose loopback is not the golden one any more.

    The residual is taken after delays are removed, so it tells of lost samples and
    of gain; both are compared by themselves too, to a finer limit.
    """
    golden, cable = take.golden, take.cable
    if golden is None or cable is None or golden.loopback is None or take.swapped:
        return
    change = take.reference.clock.latency - golden.clock.latency
    gain = _gain_db(take)
    take.figures["latency_change_samples"] = round(float(change), 4)
    take.figures["gain_change_db"] = round(gain, 4)
    if abs(change) > take.limits.latency_change:
        yield Finding(
            "latency_change",
            True,
            f"the latency changed by {change:+.2f} samples since the first take: "
            "was the stream opened again?",
            float(change),
            take.limits.latency_change,
            "samples",
        )
    if abs(gain) > take.limits.gain_change_db:
        yield Finding(
            "gain_change",
            True,
            f"the loopback's gain changed by {gain:+.2f} dB since the first take",
            gain,
            take.limits.gain_change_db,
            "dB",
        )
    worst, floor, time = _residual(take, change)
    take.figures["golden_residual_db"] = round(worst, 1)
    limit = max(take.limits.golden_residual_db, floor + CONTRAST_DB)
    if worst > limit:
        yield Finding(
            "loopback_changed",
            True,
            f"the loopback differs from the first take's by {worst:.1f} dB at "
            f"{time:.2f} s",
            worst,
            limit,
            "dB",
            time=time,
        )


def _gain_db(take: Evidence) -> float:
    excitation = take.reference.excitation
    f = excitation.frequencies
    low, high = excitation.band
    first, last = np.searchsorted(f, (1.5 * low, high / 1.5))
    here = np.abs(take.reference.gain[first:last]).mean()
    there = np.abs(take.golden.gain[first:last]).mean() if take.golden else np.nan
    return float(20 * np.log10(here / there))


def _residual(take: Evidence, change: float) -> tuple[float, float, float]:
    excitation = take.reference.excitation
    golden, cable = take.golden, take.cable
    if golden is None or cable is None or golden.loopback is None:
        return np.nan, np.nan, np.nan
    turns = excitation.frequencies / excitation.sample_rate
    spectrum = excitation.transform(cable.samples) * np.exp(2j * np.pi * change * turns)
    rest = excitation.inverse(spectrum)[: golden.loopback.size] - golden.loopback
    size = max(round(0.01 * excitation.sample_rate), 8)
    count = rest.size // size
    blocks = np.mean(rest[: count * size].reshape(count, size) ** 2, axis=1)
    levels = 10 * np.log10(blocks / cable.power + 1e-30)
    begin = max(int(golden.clock.latency / size), 0) + 2
    part = levels[begin : begin + int(excitation.n_played / size) - 4]
    if not part.size:
        return np.nan, np.nan, np.nan
    worst = int(np.argmax(part))
    outside = np.concatenate((levels[: begin - 2], levels[begin + part.size + 4 :]))
    floor = float(np.median(outside)) if outside.size > 4 else -300.0
    return float(part[worst]), floor, (begin + worst) * 0.01
