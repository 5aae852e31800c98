"""The loopback of one take by itself."""

from collections.abc import Iterator

import numpy as np

from capture.checks.events import worst_event
from capture.checks.evidence import Evidence
from capture.checks.finding import Finding
from capture.checks.table import CHECKS

__all__ = ["check_loopback"]

COMPACT_SHARE = 0.8  # cables reach 0.98, rooms 0.5 at best: halfway
CONTRAST_DB = 10.0  # below that of microphones: a cable has no decay to hide in
FEWEST = 8  # blocks of 10 ms: below that no median


@CHECKS.add("loopback")
def check_loopback(take: Evidence) -> Iterator[Finding]:
    """Refuse takes whose loopback slipped, broke, or changed its gain."""
    cable = take.cable
    if cable is None or take.swapped:
        return
    if cable.compactness < COMPACT_SHARE and cable.slip is None:
        yield Finding(
            "bad_loopback",
            True,
            f"only {100 * cable.compactness:.0f} % of the loopback's response stand "
            "within 5 ms: this is no cable, or another signal was played",
            cable.compactness,
            COMPACT_SHARE,
        )
        return
    yield from _breaks(take)
    yield from _ripple(take)


def _breaks(take: Evidence) -> Iterator[Finding]:
    cable = take.cable
    if cable is None:
        return
    rest = cable.residual_db
    excitation = take.reference.excitation
    edges = np.array([1.3 * excitation.band[0], 0.9 * excitation.band[1]])
    played = excitation.time_played(edges) + take.latency / take.sample_rate
    begin, end = (np.maximum(played, 0) / take.residual.block_s).astype(int)
    part = rest[begin:end]
    if part.size < FEWEST:
        return
    found = worst_event(10 ** (part / 10), np.ones_like(part))
    if found is None:
        return
    worst, contrast, level = found
    take.figures["loopback_residual_db"] = round(float(part.max()), 1)
    take.figures["loopback_noise_db"] = round(float(np.percentile(part, 20)), 1)
    slip = cable.slip
    limit = take.limits.loopback_event_db
    time = (begin + worst) * take.residual.block_s
    if slip is not None:
        number = abs(round(slip.samples)) or 1
        lost = slip.samples < 0
        yield Finding(
            "lost_samples" if lost else "inserted_samples",
            True,
            f"{number} samples were {'lost' if lost else 'inserted'} at about "
            f"{slip.time:.2f} s: dropped audio block",
            slip.samples,
            0.5,
            "samples",
            time=slip.time,
        )
    elif level > limit and contrast > CONTRAST_DB:
        yield Finding(
            "loopback_break",
            True,
            f"the loopback is broken at {time:.2f} s: {level:.1f} dB do not "
            "fit; dropped samples, a click, or a step of gain",
            level,
            limit,
            "dB",
            time=time,
        )


def _ripple(take: Evidence) -> Iterator[Finding]:
    excitation = take.reference.excitation
    f = excitation.frequencies
    low = max(200.0, 2 * excitation.band[0])
    high = min(8000.0, excitation.band[1] / 2)
    first, last = np.searchsorted(f, (low, high))
    if last - first < 8:
        return
    level = np.abs(take.reference.gain[first:last]) ** 2
    edges = np.unique(np.geomspace(1, level.size, 40).astype(int)) - 1
    smooth = 10 * np.log10(np.maximum(np.add.reduceat(level, edges), 1e-30))
    smooth -= 10 * np.log10(np.diff(np.append(edges, level.size)))
    middle = float(np.median(smooth))
    take.figures["loopback_gain_db"] = round(middle, 3)
    ripple = float(np.abs(smooth - middle).max())
    take.figures["loopback_ripple_db"] = round(ripple, 3)
    if ripple > take.limits.loopback_ripple_db:
        yield Finding(
            "gain_change",
            True,
            f"the loopback's gain changes by {ripple:.1f} dB while the sweep runs: "
            "an automatic gain control, or a cable that is none",
            ripple,
            take.limits.loopback_ripple_db,
            "dB",
        )
