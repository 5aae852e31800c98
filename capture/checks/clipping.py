"""Flat tops, at full scale or below."""

from collections.abc import Iterator

import numpy as np

from capture.checks.evidence import Evidence
from capture.checks.finding import Finding
from capture.checks.table import CHECKS

__all__ = ["check_clipping"]

LONGEST_LOOK = 400  # samples: enough neighbours to see the smallest step
FEWEST = 8  # equal extremes; fewer happen in quantised waves
FEWEST_IN_ROW = 3  # two equal samples straddle any crest by chance
FEWEST_EQUAL = 2  # one alone is every wave's extreme
NEAR_TOP, SPACINGS = 0.7, 8  # values near the top, eight gaps tell how dense they are
SMALLEST_CHANCE = 1e-6  # that an uncut wave shares its extreme so often
STEEP = 4.0  # quanta: the last step to the top of a slow sine is one
CROWD = 6.0  # times the samples just below: an uncut crest has about as many


@CHECKS.add("clipping")
def check_clipping(take: Evidence) -> Iterator[Finding]:
    """Refuse takes whose wave is cut flat, at whatever level.

    A clipped wave enters its plateau steeply; the top of a quantised slow sine is
    flat too, but its last step is one quantum. And many samples share the extreme
    value while next to none lie just below. What was clipped before a filter has no
    plateau left: there the response predicts crests that the recording lacks.
    """
    rows = [(int(index), row) for index, row in enumerate(take.recording)]
    if take.reference.loopback is not None:
        rows.append((-1, take.reference.loopback))
    counts = []
    for channel, row in rows:
        count, at = clipped_samples(row)
        counts.append(count)
        if not count:
            yield from _cut_crests(take, channel)
            continue
        name = "the loopback" if channel < 0 else f"channel {channel}"
        level = 20 * np.log10(max(np.abs(row).max(), 1e-30))
        yield Finding(
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


def _cut_crests(take: Evidence, channel: int) -> Iterator[Finding]:
    """Find crests cut so smoothly that no two samples are equal."""
    crests = take.crests
    if crests is None or channel < 0 or not take.finite[channel]:
        return
    excess, sigma = float(crests.excess[channel]), float(crests.sigma[channel])
    top, limits = float(take.peaks[channel]), take.limits
    limit = max(limits.crest_sigmas * sigma, limits.crest_percent / 100 * top)
    if not excess > limit:
        return
    at = int(crests.at[channel])
    over = 20 * np.log10(1 + excess / top)
    yield Finding(
        "clipped",
        True,
        f"channel {channel} is clipped at {20 * np.log10(top):.1f} dBFS, or limited: "
        f"its response predicts a crest {over:.2f} dB higher at {take.seconds(at)}; "
        "lower the gain",
        excess / top,
        limit / top,
        "",
        channel,
        at / take.sample_rate,
    )


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
    if on.size < FEWEST_EQUAL:
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
    crowded = crowded or _chance(row, top, on.size, quantum) < SMALLEST_CHANCE
    return (int(on.size), int(on[0])) if crowded else (0, row.size)


def _chance(row: np.ndarray, top: float, count: int, quantum: float) -> float:
    """Return how likely so many samples share the extreme of an uncut wave.

    Neighbours in the order of size are about as far apart at the very top as just
    below it; what is closer than a quantum is equal.
    """
    values = np.abs(row[np.sign(top) * row > NEAR_TOP * abs(top)])
    values = np.unique(values)[-1 - SPACINGS :]
    if values.size <= SPACINGS:
        return 1.0
    spacing = float(values[-1] - values[0]) / SPACINGS
    return min(1.0, 2 * quantum / spacing) ** (count - 1)
