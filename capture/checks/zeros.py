"""Samples that a broken stream replaced by zeros."""

from collections.abc import Iterator

import numpy as np

from capture.checks.evidence import Evidence
from capture.checks.finding import Finding
from capture.checks.table import CHECKS

__all__ = ["check_zeros"]

FEWEST = 8  # zeros in a row: a quantised quiet wave has fewer
STEEP = 4.0  # quanta: a wave enters its zeros by one
LOOK = 64  # samples either side that show the wave's quantum and level


@CHECKS.add("zeros")
def check_zeros(take: Evidence) -> Iterator[Finding]:
    """Refuse takes with runs of exact zeros inside the sweep.

    A quiet quantised wave passes zero in runs as well, but enters and leaves them
    by one quantum.
    """
    begin = max(int(take.latency), 0)
    end = begin + take.reference.excitation.n_played
    rows = [(int(index), row) for index, row in enumerate(take.recording)]
    if take.reference.loopback is not None:
        rows.append((-1, take.reference.loopback))
    for channel, row in rows:
        at, length, stops = longest_gap(row, begin, end)
        if not length:
            continue
        name = "the loopback" if channel < 0 else f"channel {channel}"
        word = "stops_early" if stops else "zeroed_samples"
        what = "stops" if stops else f"has {length} samples of exact zero"
        yield Finding(
            word,
            True,
            f"{name} {what} at {take.seconds(at)}: samples were dropped",
            float(length),
            float(FEWEST),
            "samples",
            None if channel < 0 else channel,
            at / take.sample_rate,
        )


def longest_gap(row: np.ndarray, begin: int, end: int) -> tuple[int, int, bool]:
    """Return start and length of the longest broken run of zeros in a range.

    The third value says whether the zeros last to the end of the row.

    Examples
    --------
    >>> wave = np.sin(np.arange(4000) * 0.05 + 0.1)
    >>> wave[1000:1020] = 0
    >>> longest_gap(wave, 0, 4000)
    (1000, 20, False)
    """
    part = row[begin:end]
    zero = np.flatnonzero(part == 0)
    if zero.size < FEWEST or zero.size == part.size:
        return 0, 0, False
    breaks = np.flatnonzero(np.diff(zero) > 1)
    starts = np.concatenate(([zero[0]], zero[breaks + 1])) + begin
    ends = np.concatenate((zero[breaks], [zero[-1]])) + begin + 1
    best = (0, 0, False)
    for start, stop in zip(starts, ends, strict=True):
        length = int(stop - start)
        if length < max(FEWEST, best[1] + 1) or start == begin:
            continue
        lasts = not np.any(row[stop:])
        if lasts and stop < end:
            continue
        before, after = row[max(start - LOOK, 0) : start], row[stop : stop + LOOK]
        steps = np.diff(np.unique(np.abs(np.concatenate(([0.0], before, after)))))
        quantum = float(steps.min()) if steps.size else 0.0
        jump = max(abs(row[start - 1]), 0.0 if lasts else abs(row[stop]))
        loud = np.sqrt(np.mean(before**2))
        loud = loud if lasts else min(loud, np.sqrt(np.mean(after**2)))
        if jump > STEEP * quantum and loud > STEEP * quantum:
            best = (int(start), length, lasts)
    return best
