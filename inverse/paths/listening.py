"""The listener's pattern, where none is stated and it is directional."""

from dataclasses import dataclass, replace

import numpy as np

from inverse.paths.polyhedral import FittedMesh
from inverse.paths.resumed import resumed
from inverse.paths.room import OMNI
from inverse.paths.shoebox import FittedRoom, without_slow
from inverse.rows.fitset import FitSet
from inverse.rows.unexplained import CLEAN, unexplained_energy
from rir import GainPattern, Poses
from rir.arrays import FloatArray

__all__ = ["ListenerFit", "fit_listener", "pattern_of"]

ORDER, FITTED_ROWS, FRESH_ROWS = 2, 60, 60
"""Nine numbers: microphones of pressure and gradient; some seven rows a number."""
ROUNDS = 4
"""Turns of pattern and walls: each but the first gains little (decision 0063)."""
WORTH, HOPEFUL = 0.9, 0.97
"""Of what fresh rows left: a tenth less is no chance in 60 rows; a turn that gains less
than 3 % will not come to a tenth."""
TURNED_DEG = 15.0
"""Between mean and single aims: less turns a cardioid's levels by a few per cent."""
RIDGE = 1e-4
"""Of the mean square column, towards the pattern so far: holds what no row tells."""
LEAST_LEVEL = 0.05  # of the mean gain: a pattern with less is none of a microphone


@dataclass(frozen=True, eq=False)
class ListenerFit:
    """Hold a room with its listener's pattern; `found` if that is not the old one."""

    fitted: FittedRoom | FittedMesh
    found: bool


def fit_listener(rows: FitSet, fitted: FittedRoom | FittedMesh) -> ListenerFit:
    """Fit the listener's pattern in turns with walls and emitter.

    Taken only where listeners were turned, and rows that were not fitted are
    predicted better by a tenth.
    """
    none = ListenerFit(fitted, False)
    if len(rows) < FITTED_ROWS + FRESH_ROWS // 2 or not _turned(rows.listeners):
        return none
    few = rows.spread(FITTED_ROWS)
    fresh = rows.spread_rest(FITTED_ROWS).spread(FRESH_ROWS)
    before = unexplained_energy(fresh, fitted)
    if before < CLEAN:
        return none
    tried, last = fitted, before
    for turn in range(ROUNDS):
        better = _with_pattern(few, tried)
        if turn == 0 and unexplained_energy(fresh, better) > HOPEFUL * before:
            return none
        try:
            better = resumed(rows, better, count=FITTED_ROWS, turns=1)
        except np.linalg.LinAlgError:
            return none
        left = unexplained_energy(fresh, better)
        if left < last:
            tried, gain, last = better, left / last, left
            if gain > HOPEFUL:
                break
        else:
            break
    if last > WORTH * before:
        return none
    return ListenerFit(tried, True)


def pattern_of(fitted: FittedRoom | FittedMesh) -> GainPattern:
    """Return the listener's pattern of a fitted room."""
    return GainPattern(fitted.room.listening[None], np.array([1000.0]))


def _turned(listeners: Poses) -> bool:
    """Return whether listeners look into different directions."""
    x, y, z, w = listeners.orientations.T
    ahead = np.stack(
        [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)]
    )
    spread = ahead.T @ ahead.mean(axis=1)
    return bool(
        np.linalg.norm(ahead.mean(axis=1)) < np.cos(np.radians(TURNED_DEG))
    ) or (bool(spread.min() < np.cos(np.radians(2 * TURNED_DEG))))


def _with_pattern(
    rows: FitSet, fitted: FittedRoom | FittedMesh
) -> FittedRoom | FittedMesh:
    """Solve for the listener's pattern, all else as it stands."""
    count = (ORDER + 1) ** 2
    weight = 1 / np.sqrt(np.maximum((rows.responses**2).sum(axis=1), 1e-300))
    columns = np.empty((count, rows.responses.size))
    for k in range(count):
        predicted = _heard_by(rows, fitted, np.eye(count)[k])
        quick = without_slow(predicted, rows.sample_rate)
        columns[k] = (quick * weight[:, None]).ravel()
    target = without_slow(rows.responses, rows.sample_rate) * weight[:, None]
    square = columns @ columns.T
    old = np.zeros(count)
    kept = fitted.room.listening[:count]
    old[: len(kept)] = kept
    ridge = RIDGE * float(np.trace(square)) / count
    right = columns @ target.ravel() + ridge * old
    found = np.linalg.solve(square + ridge * np.eye(count), right)
    level = float(found[0] / OMNI[0])
    if level < LEAST_LEVEL:
        return fitted
    # one of the two levels is free: the emitter keeps it
    room = replace(
        fitted.room,
        listening=np.ascontiguousarray(found / level),
        emitting=fitted.room.emitting * level,
    )
    return _with_room(fitted, room)


def _heard_by(
    rows: FitSet, fitted: FittedRoom | FittedMesh, pattern: FloatArray
) -> FloatArray:
    room = replace(fitted.room, listening=np.ascontiguousarray(pattern))
    heard = _with_room(fitted, room)
    return heard.predict(rows.emitters, rows.listeners, rows.n_samples)


def _with_room(fitted, room) -> FittedRoom | FittedMesh:
    return replace(fitted, room=room)
