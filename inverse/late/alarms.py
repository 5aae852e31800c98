"""Alarms of the completion: what is not explained, in words."""

import numpy as np

from inverse.late.gate import Gate
from inverse.rows.fitset import FitSet
from inverse.rows.regions import Regions
from inverse.rows.tiles import Tiles

__all__ = ["completion_alarms"]

LEVEL_ALARM_DB = 1.0  # just audible (ISO 3382-1, strength); decision 0059
OPEN_ALARM = 0.9  # of octaves and times after 30 ms in which waveforms fail (0059)
NEPER_DB = 10 / np.log(10)  # decibels a neper of energy
SILENT_NEPER = 30 / NEPER_DB  # 30 dB: no error of a level, but a row that is silent


def completion_alarms(
    fit_set: FitSet,
    gate: Gate,
    tiles: Tiles,
    misfit: np.ndarray,
    regions: Regions,
) -> list[str]:
    """Say in words what is not explained."""
    alarms = []
    late = tiles.times >= 0.03
    open_share = float((gate.shares[:, :, late] < 0.5).mean()) if late.any() else 0.0
    if open_share > OPEN_ALARM:
        alarms.append(
            "paths do not explain this room: their waveforms fail in "
            f"{100 * open_share:.0f} % of the octaves and times after 30 ms"
        )
    level = _level_error(misfit, fit_set.places)
    if level > LEVEL_ALARM_DB:
        alarms.append(
            f"late level of an emitter left out is told to {level:.1f} dB only; "
            "record more emitter places, or a pair with exchanged ends"
        )
    alarms += _unheard_regions(fit_set, regions)
    return alarms


def _level_error(misfit: np.ndarray, places: np.ndarray) -> float:
    """Return the rms over emitters of the mean level error, dB."""
    if len(np.unique(places)) < 2:
        return 0.0
    # a simulator's digital silence is no level
    known = np.abs(misfit) < SILENT_NEPER
    weight = np.where(known, 1.0, 0.0)
    gaps = []
    for place in np.unique(places):
        mine = places == place
        total = weight[mine].sum()
        if total > 0:
            level = np.where(known[mine], misfit[mine], 0.0).sum() / total
            gaps.append(NEPER_DB * level)
    return float(np.sqrt(np.mean(np.square(gaps)))) if gaps else 0.0


def _unheard_regions(fit_set: FitSet, regions: Regions) -> list[str]:
    if regions.count < 2:
        return []
    numbers = regions.numbers(fit_set.emitters.positions)
    missing = sorted(set(range(regions.count)) - set(numbers.tolist()))
    return [
        f"no emitter stood in region {number + 1} of {regions.count} (round "
        f"{_middle(regions, number)} m): its own decay is unknown; record one "
        "pair with exchanged ends there"
        for number in missing
    ]


def _middle(regions: Regions, number: int) -> str:
    mine = regions.shares.argmax(axis=1) == number
    middle = regions.places[mine if mine.any() else slice(None)].mean(axis=0)
    return f"({middle[0]:.1f}, {middle[1]:.1f}, {middle[2]:.1f})"
