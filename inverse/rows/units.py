"""Units of poses and sample rate, checked by the speed of direct sounds.

Poses in millimetres or feet and a wrong sample rate look like sound at an impossible
speed. Hot or cold air looks like one a few per cent off.
"""

from dataclasses import replace

import numpy as np

from inverse.rows.fitset import FitSet
from rir.arrays import FloatArray
from rir.onset import find_onset

__all__ = ["checked_units", "travelled_speed"]

LEAST_ROWS, MOST_ROWS = 12, 150  # fewer give no median; 150 give 11,000 slopes
ONSET = 0.3  # of a row's peak; what comes first above it is taken for its direct sound
ALIKE = 0.93
"""Onsets must follow distances so closely that most stand off by 7 % of their range."""
WARMEST, COLDEST = 365.0, 319.0  # metres per second, at 55 and -20 °C
KNOWN = 0.012
"""Part of the speed that is no other air: 7 K, or what onsets are misread by."""
CLOSE_M = 0.02  # a speed of air is taken over where most onsets follow it so closely
TOGETHER_S = 5e-4  # delays within it are alike: 17 cm, what onsets are read to
UNITS = {1000.0: "millimetres", 100.0: "centimetres", 3.2808: "feet", 39.37: "inches"}
NAMED = 0.06  # part by which a speed may miss a unit: air and onsets are off as much


def checked_units(rows: FitSet) -> tuple[FitSet, list[str]]:
    """Return rows with the speed of sound they show, and alarms on their units.

    Speeds of air from -20 to 55 degrees are taken over; others are only reported.
    """
    found = travelled_speed(rows)
    if found is None:
        return rows, []
    speed, spread_m = found
    if abs(speed / rows.speed_of_sound - 1) < KNOWN:
        return rows, []
    if COLDEST < speed < WARMEST:
        sure = spread_m < CLOSE_M + 0.5 * speed / rows.sample_rate
        return (replace(rows, speed_of_sound=speed) if sure else rows), []
    ratio = speed / rows.speed_of_sound
    unit = [name for one, name in UNITS.items() if abs(ratio / one - 1) < NAMED]
    guess = (
        f"as if poses were told in {unit[0]}"
        if unit
        else (f"as if the sample rate were {rows.sample_rate / ratio:.0f} Hz")
    )
    return rows, [
        f"direct sounds travel at {speed:.0f} m/s by poses and sample rate, {guess}: "
        "poses need metres and responses their own sample rate; no walls are looked "
        "for"
    ]


def travelled_speed(rows: FitSet) -> tuple[float, float] | None:
    """Return the speed of direct sounds, m/s, and their median misfit, metres.

    The median of slopes between rows (Theil 1950, Sen 1968); None where onsets do
    not follow distances.
    """
    rows = rows.spread(MOST_ROWS)
    sounding = rows.responses.any(axis=1) & (rows.distances > 0)
    if sounding.sum() < LEAST_ROWS:
        return None
    onset = find_onset(rows.responses[sounding], ONSET)
    times, reach = onset / rows.sample_rate, rows.distances[sounding]
    one, other = np.triu_indices(len(reach), 1)
    apart = reach[other] - reach[one]
    far = np.abs(apart) > 0.3 * np.ptp(reach)
    if far.sum() < LEAST_ROWS:
        return None
    slope = float(np.median((times[other] - times[one])[far] / apart[far]))
    if slope <= 0 or slope * np.ptp(reach) * rows.sample_rate < LEAST_ROWS:
        return None
    left = times - slope * reach
    # bent ways are late the more the farther; sound in sight is not
    delays = times - reach / rows.speed_of_sound
    airy = COLDEST < 1 / slope < WARMEST
    if not airy and _gathered(delays) >= _gathered(left):
        return None
    left = np.abs(left - np.median(left))
    # most rows must follow, however late the rest of them are
    off = float(np.median(left))
    if off > (1 - ALIKE) * slope * np.ptp(reach):
        return None
    return 1 / slope, off / slope


def _gathered(delays: FloatArray) -> float:
    """Return the largest share of delays that lie within a short time."""
    order = np.sort(delays)
    last = np.searchsorted(order, order + TOGETHER_S, side="right")
    return float((last - np.arange(len(order))).max()) / len(order)
