"""Flat tops, at full scale or below."""

from collections.abc import Iterator

import numpy as np

from capture.checks.table import CHECKS
from capture.evidence import Evidence
from capture.verdict import Verdict

__all__ = ["check_clipping"]

LONGEST_LOOK = 400
FEWEST = 8
FEWEST_IN_ROW = 3
STEEP = 4.0
CROWD = 6.0


@CHECKS.add("clipping")
def check_clipping(take: Evidence) -> Iterator[Verdict]:
    """Refuse takes whose wave is cut flat, at whatever level.

    A clipped wave enters its plateau steeply; the top of a quantised slow sine is
    flat too, but its last step is one quantum. And many samples share the extreme
    value while next to none lie just below.
    """
    rows = [(int(index), row) for index, row in enumerate(take.recording)]
    if take.reference.loopback is not None:
        rows.append((-1, take.reference.loopback))
    counts = []
    for channel, row in rows:
        count, at = clipped_samples(row)
        counts.append(count)
        if not count:
            continue
        name = "the loopback" if channel < 0 else f"channel {channel}"
        level = 20 * np.log10(max(np.abs(row).max(), 1e-30))
        yield Verdict(
            "clipped",
            True,
            f"{name} is clipped at {level:.1f} dBFS: {count} samples, first at "
            f"{take.seconds(at)}; lower the gain",
            float(count),
            0.0,
            "samples",
            None if channel < 0 else channel,
            at / take.sample_rate,
        )
    take.figures["clipped_samples"] = counts


def clipped_samples(row: np.ndarray) -> tuple[int, int]:
    """Return how many samples lie on a plateau, and where the first does.

    Examples
    --------
    >>> wave = np.sin(np.arange(4000) * 0.05)
    >>> clipped_samples(wave)[0], clipped_samples(np.minimum(wave, 0.9))[0] > 100
    (0, True)
    """
    total, first = 0, row.size
    for top in (row.max(), row.min()):
        if top == 0:
            continue
        count, at = _plateau(row, top)
        total, first = total + count, min(first, at)
    return total, first if total else 0


def _plateau(row: np.ndarray, top: float) -> tuple[int, int]:
    on = np.flatnonzero(row == top)
    if on.size < FEWEST_IN_ROW:
        return 0, row.size
    breaks = np.flatnonzero(np.diff(on) > 1)
    starts = np.concatenate(([on[0]], on[breaks + 1]))
    ends = np.concatenate((on[breaks], [on[-1]]))
    near = np.abs(row[max(on[0] - LONGEST_LOOK, 0) : on[0] + LONGEST_LOOK])
    steps = np.diff(np.unique(near))
    quantum = float(steps.min()) if steps.size else 0.0
    before = np.abs(top - row[np.maximum(starts - 1, 0)])
    after = np.abs(top - row[np.minimum(ends + 1, row.size - 1)])
    steep = np.maximum(before, after) > STEEP * quantum
    lengths = ends - starts + 1
    if lengths.max() > row.size // 2:
        return 0, row.size
    if np.any((lengths >= FEWEST_IN_ROW) & steep):
        return int(on.size), int(on[0])
    width = max(quantum, 1e-4 * abs(top))
    close = np.abs(row - top)
    below = np.count_nonzero((close > 0.5 * width) & (close < 1.5 * width))
    crowded = on.size >= FEWEST and on.size > CROWD * (below + 1) and np.any(steep)
    return (int(on.size), int(on[0])) if crowded else (0, row.size)
