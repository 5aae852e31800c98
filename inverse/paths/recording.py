"""The recording, by a first room: air of each block, listener, places of rows."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from inverse.paths.air import BlockAir, read_block_air
from inverse.paths.listening import fit_listener, pattern_of
from inverse.paths.places import correct_places, placed
from inverse.paths.polyhedral import FittedMesh
from inverse.paths.resumed import resumed
from inverse.paths.shoebox import FittedRoom
from inverse.rows.fitset import FitSet
from rir import GainPattern

__all__ = ["RecordedRoom", "find_listener", "fit_air", "move_places"]

CORRECTED = "pose_corrections"
ROUNDS, STILL = 4, 3e-5
"""Turns of air and room, and the change of a block's speed that ends them."""
BLOCK_ROWS, MOST_ROWS = 24, 240
"""Rows read: of each block enough for a scatter, of all no more than a fit costs."""


@dataclass(frozen=True, eq=False)
class RecordedRoom:
    """Hold a fitted room with what was found of its recording."""

    fitted: FittedRoom | FittedMesh | None
    """The room, None where none was found."""
    air: BlockAir | None = None
    """Of its blocks; None if one for all."""
    found: dict[str, Any] = field(default_factory=dict)
    """What to report."""
    latency_s: float = 0.0
    """Instant that times are stretched about."""
    heard_by: GainPattern | None = None
    """The listener's pattern, where it was fitted."""

    def even(self, rows: FitSet) -> FitSet:
        """Return rows resampled to the mean speed of sound."""
        return rows if self.air is None else self.air.even(rows, self.latency_s)

    def placed(
        self, rows: FitSet, fitted: FittedRoom | FittedMesh, sigma: float
    ) -> FitSet:
        """Return rows with their places corrected, where that paid in the fit."""
        return placed(rows, fitted, sigma) if CORRECTED in self.found else rows

    def onto(self, fitted: FittedRoom | FittedMesh) -> "RecordedRoom":
        """Return what was found of the recording with another fitted room."""
        return replace(self, fitted=fitted)


def fit_air(rows: FitSet, fitted: FittedRoom | FittedMesh) -> RecordedRoom:
    """Give every recording block its speed of sound, and fit the room again."""
    numbers = np.unique(rows.blocks)
    if len(numbers) < 2:
        return RecordedRoom(fitted)
    few = rows.rows(_some_of_each(rows.blocks))
    air, better = None, fitted
    for _ in range(ROUNDS):
        predicted = better.predict(few.emitters, few.listeners, few.n_samples)
        latency = better.room.latency_s
        heard = read_block_air(few, predicted, latency, even=air)
        if air is None and not heard.differs:
            return RecordedRoom(fitted)
        moved = np.abs(heard.changes - (0 if air is None else air.changes)).max()
        air = heard
        if moved < STILL:
            break
        try:
            better = resumed(air.even(rows, latency), better)
        except np.linalg.LinAlgError:
            return RecordedRoom(fitted)
    if air is None:
        return RecordedRoom(fitted)
    speed = better.room.speed_of_sound
    report = {
        "blocks": [
            {
                "rows": int((rows.blocks == number).sum()),
                "speed_of_sound": float(speed * (1 + change)),
                "speed_of_sound_sd": float(speed * sd),
            }
            for number, change, sd in zip(
                air.numbers, air.changes, air.sds, strict=True
            )
        ]
    }
    return RecordedRoom(better, air, report, better.room.latency_s)


def find_listener(rows: FitSet, settled: RecordedRoom) -> RecordedRoom:
    """Find out whether the listener is directional."""
    if settled.fitted is None:
        return settled
    heard = fit_listener(rows, settled.fitted)
    if not heard.found:
        return settled
    pattern = heard.fitted.room.listening
    found = settled.found | {"listener_pattern": pattern.tolist()}
    gain = pattern_of(heard.fitted)
    return replace(settled, fitted=heard.fitted, found=found, heard_by=gain)


def move_places(rows: FitSet, settled: RecordedRoom, sigma: float) -> RecordedRoom:
    """Correct the places of fitted rows where that lowers the error of others."""
    if settled.fitted is None:
        return settled
    corrected = correct_places(rows, settled.fitted, sigma)
    report = corrected.report()
    if not report:
        return settled
    found = settled.found | {CORRECTED: report}
    return replace(settled, fitted=corrected.fitted, found=found)


def _some_of_each(blocks: np.ndarray) -> np.ndarray:
    """Return rows of every block, no more of one than are needed."""
    numbers = np.unique(blocks)
    most = max(BLOCK_ROWS, MOST_ROWS // len(numbers))
    chosen = []
    for number in numbers:
        mine = np.flatnonzero(blocks == number)
        chosen.append(
            mine[np.linspace(0, len(mine) - 1, min(most, len(mine))).astype(int)]
        )
    return np.sort(np.concatenate(chosen))
