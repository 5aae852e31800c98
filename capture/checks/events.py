"""Knocks, clicks, gaps: sound that the sweep does not explain."""

from collections.abc import Iterator

import numpy as np

from capture.checks.evidence import Evidence
from capture.checks.finding import Finding
from capture.checks.table import CHECKS

__all__ = ["check_events"]

AROUND = 12  # blocks: 0.12 s either side, longer than a knock sounds
QUIET_SHARE = 0.05  # of the mean: before the sweep any hiss would be loud
SHIFT_S = 0.002  # below, a room's own dispersion between octaves looks the same
SEARCH_S = 0.03  # three blocks of 512 samples: more is a new recording
RESOLUTION = 1.5  # periods: the width of a two-octave envelope


@CHECKS.add("events")
def check_events(take: Evidence) -> Iterator[Finding]:
    """Find moments at which a recording holds more than sweep and response.

    The part of the take that lies outside response and harmonics is played through
    the sweep again and compared, block by block, with its own median, with its
    neighbours, and with the sound of the moment.
    """
    rest, whole = take.residual.unexplained, take.residual.whole
    worst_db = []
    for row, group in zip(range(len(rest)), take.groups, strict=True):
        found = worst_event(rest[row], whole[row])
        if found is None:
            worst_db.append(None)
            continue
        block, contrast, level = found
        worst_db.append(round(level, 1))
        hard = contrast > take.limits.event_contrast_db and (
            level > take.limits.event_level_db
        )
        if not hard:
            continue
        time = (block + 0.5) * take.residual.block_s
        yield from _name(take, group, time, contrast, level)
    take.figures["event_db"] = worst_db


def worst_event(rest: np.ndarray, whole: np.ndarray) -> tuple[int, float, float] | None:
    """Return block, contrast [dB] and level [dB] of the loudest unexplained moment."""
    if rest.size < 2 * AROUND or not np.any(whole):
        return None
    pair = (rest[1:] + rest[:-1]) / 2
    base = np.median(rest)
    near = _surroundings(rest)
    sound = np.maximum((whole[1:] + whole[:-1]) / 2, QUIET_SHARE * np.mean(whole))
    floor = np.maximum(np.maximum(base, near), 1e-12 * np.max(whole))
    level = 10 * np.log10(pair / np.maximum(sound, 1e-300) + 1e-30)
    contrast = 10 * np.log10(pair / floor + 1e-30)
    score = np.minimum(contrast, level + 60)
    block = int(np.argmax(score))
    return block, float(contrast[block]), float(level[block])


def _surroundings(rest: np.ndarray) -> np.ndarray:
    """Return the larger median of the time before and after each pair of blocks.

    The rest grows where the sweep begins and falls where it ends; next to such a
    step only one side, or what lies around, tells what is usual.
    """
    padded = np.pad(rest, AROUND, mode="edge")
    view = np.lib.stride_tricks.sliding_window_view(padded, 2 * AROUND)
    near = np.median(view, axis=1)
    count = rest.size - 1
    inner = near[AROUND : AROUND + rest.size - 2 * AROUND + 1]
    near = near[:count].copy()
    earlier, later = near[2 * AROUND :], near[: max(count - 2 * AROUND, 0)]
    np.maximum(earlier, inner[: earlier.size], out=earlier)
    np.maximum(later, inner[2 : 2 + later.size], out=later)
    return near


def _name(
    take: Evidence, group: list[int], time: float, contrast: float, level: float
) -> Iterator[Finding]:
    channel = group[0] if len(group) == 1 else None
    where = f"channel {group[0]}" if len(group) == 1 else f"channels {group}"
    figures = (level, take.limits.event_level_db, "dB", channel, time)
    if take.cable is not None:
        slip = take.cable.slip
        shift = slip.samples / take.sample_rate if slip else 0.0
    else:
        shift = _shift(take, group[0], time)
    if shift:
        lost = shift < 0
        yield Finding(
            "lost_samples" if lost else "inserted_samples",
            True,
            f"{where}: about {abs(shift) * take.sample_rate:.0f} samples were "
            f"{'lost' if lost else 'inserted'} at {time:.2f} s",
            *figures,
        )
    else:
        yield Finding(
            "event",
            True,
            f"{where}: a knock, click or gap at {time:.2f} s, {contrast:.0f} dB over "
            f"the rest and {level:.0f} dB relative to the sound there",
            *figures,
        )


def _shift(take: Evidence, channel: int, time: float) -> float:
    """Return how much later the response is above the frequency of a moment, s.

    The two parts of the response are compared by the peaks of their envelopes; what
    the narrower one cannot resolve counts as no shift.
    """
    excitation = take.reference.excitation
    low, high = excitation.band
    grid = np.geomspace(1.2 * low, high / 1.2, 300)
    played = excitation.time_played(grid) + np.nanmin(take.onset[channel]) / (
        take.sample_rate
    )
    middle = float(np.interp(time, played, grid))
    if not 4 * low < middle < high / 4:
        return 0.0
    size = 2 * take.response.shape[1]
    spectrum = np.fft.rfft(take.response[channel], size)
    f = np.fft.rfftfreq(size, 1 / take.sample_rate)
    peaks = []
    for bottom, top in ((middle / 8, middle / 1.3), (1.3 * middle, 8 * middle)):
        shape = np.clip(
            np.log(np.maximum(f, 1e-9) / bottom) / np.log(top / bottom), 0, 1
        )
        wave = np.fft.ifft(spectrum * np.sin(np.pi * shape) ** 2, size)
        peaks.append(int(np.argmax(np.abs(wave[: size // 2]))))
    shift = (peaks[1] - peaks[0]) / take.sample_rate
    resolved = max(SHIFT_S, RESOLUTION / middle)
    return shift if resolved < abs(shift) < SEARCH_S else 0.0
