"""Correct the places of fitted rows by the paths, within their stated error.

Each row has three coordinates at both ends, known to a stated standard deviation.
What a response follows when an end moves is taken by differences, so that one way
serves boxes, rooms of flat faces and sound bent around edges. Walls are fitted again
to the corrected rows. Places asked for are never corrected.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from inverse.paths.polyhedral import FittedMesh
from inverse.paths.resumed import resumed
from inverse.paths.shoebox import FittedRoom, without_slow
from inverse.rows.fitset import FitSet
from inverse.rows.unexplained import unexplained_energy
from rir import Poses
from rir.arrays import FloatArray

__all__ = ["Corrected", "correct_places", "placed"]

ROWS, FRESH_ROWS, LEAST_ROWS = 60, 60, 12
"""Rows corrected and kept out: as many as a fit of walls needs; a few correct nothing,
for walls would follow them."""
HEARD_S = 0.04  # early sound tells where an end is; late sound only repeats it
STEP_M = 2e-4  # of differences: small beside the waves, large beside rounding
ROUNDS, STEPS = 2, 2
"""Turns of places and walls, and steps of places: they move by millimetres."""
LEFT, MOST = 0.01, 0.3
"""Where paths leave less no place is worth correcting, where more it is not places."""
WORTH, HARMLESS, PROVEN_ROWS = 0.8, 1.06, 16
"""Corrected rows must leave a fifth less, and fresh ones, whose places stay wrong, no
more than 6 % more; so many fresh rows, corrected, decide between the rooms."""
CAUSE = 0.5
"""A box that leaves more at the first corrected places has other faults than those."""
FARTHEST = 4.0  # sigmas that one coordinate may move


@dataclass(frozen=True, eq=False)
class Corrected:
    """Hold a room fitted to corrected rows.

    Parameters
    ----------
    fitted : FittedRoom or FittedMesh
        The room; the old one where corrections did not pay.
    shifts : ndarray, shape (rows, 6)
        Of emitter and listener, metres; empty where none was made.
    before, after : float
        Part of the energy of the corrected rows that paths left.
    """

    fitted: FittedRoom | FittedMesh
    shifts: FloatArray
    before: float
    after: float

    def report(self) -> dict[str, Any]:
        """Return what was corrected, in plain values."""
        if len(self.shifts) == 0:
            return {}
        return {
            "rows": len(self.shifts),
            "rms_m": float(np.sqrt((self.shifts**2).mean())),
            "largest_m": float(np.abs(self.shifts).max()),
            "unexplained_before": self.before,
            "unexplained_after": self.after,
        }


def correct_places(
    rows: FitSet, fitted: FittedRoom | FittedMesh, sigma: float
) -> Corrected:
    """Move the ends of some rows and fit the room to them.

    Parameters
    ----------
    rows : FitSet
        Rows as far as paths are listed.
    fitted : FittedRoom or FittedMesh
        The room so far.
    sigma : float
        Standard deviation of each stated coordinate, metres; 0 corrects none.
    """
    none = Corrected(fitted, np.empty((0, 6)), 0.0, 0.0)
    few = rows.spread(ROWS)
    if sigma <= 0 or len(few) < LEAST_ROWS:
        return none
    before = unexplained_energy(few, fitted)
    if not LEFT < before < MOST:
        return none
    room, moved, shifts = fitted, few, np.zeros((len(few), 6))
    for _ in range(ROUNDS):
        shifts = _corrected(few, shifts, room, sigma)
        moved = _at(few, shifts)
        first = room is fitted and isinstance(room, FittedRoom)
        if first and unexplained_energy(moved, room) > CAUSE * before:
            return none
        try:
            room = resumed(moved, room, count=ROWS)
        except np.linalg.LinAlgError:
            return none
    after = unexplained_energy(moved, room)
    fresh = rows.spread_rest(ROWS).spread(FRESH_ROWS) if len(rows) > ROWS else few
    worse = unexplained_energy(fresh, room) > HARMLESS * unexplained_energy(
        fresh, fitted
    )
    if after > WORTH * before or worse:
        return none
    # rows kept out, put where either room says they stood, decide between rooms
    some = fresh.spread(PROVEN_ROWS)
    old, new = (
        unexplained_energy(placed(some, one, sigma), one) for one in (fitted, room)
    )
    if new > old:
        return none
    return Corrected(room, shifts, before, after)


def placed(rows: FitSet, fitted: FittedRoom | FittedMesh, sigma: float) -> FitSet:
    """Return rows with their ends where the room's paths put them."""
    return _at(rows, _corrected(rows, np.zeros((len(rows), 6)), fitted, sigma))


def _corrected(
    rows: FitSet, shifts: FloatArray, fitted: FittedRoom | FittedMesh, sigma: float
) -> FloatArray:
    for _ in range(STEPS):
        shifts = _shifted(rows, shifts, fitted, sigma)
    return shifts


def _at(rows: FitSet, shifts: FloatArray) -> FitSet:
    return replace(
        rows,
        emitters=_by(rows.emitters, shifts[:, :3]),
        listeners=_by(rows.listeners, shifts[:, 3:]),
    )


def _by(poses: Poses, moves: FloatArray) -> Poses:
    return Poses(poses.positions + moves, poses.orientations)


def _shifted(
    rows: FitSet, shifts: FloatArray, fitted: FittedRoom | FittedMesh, sigma: float
) -> FloatArray:
    """Return shifts after one step of Gauss-Newton, each row on its own."""
    heard = rows.cut(min(rows.n_samples, round(HEARD_S * rows.sample_rate)))
    fitted = _kept(heard, fitted)
    predicted = _quick(_at(heard, shifts), fitted)
    gap = without_slow(heard.responses, heard.sample_rate) - predicted
    power = np.maximum((heard.responses**2).sum(axis=1), 1e-300)
    share = float((gap**2).sum() / power.sum())
    noise = share * power / heard.n_samples
    slopes = np.empty((6, *gap.shape))
    for k in range(6):
        tried = _at(heard, shifts + STEP_M * np.eye(6)[k])
        slopes[k] = (_quick(tried, fitted) - predicted) / STEP_M
    square = np.einsum("irn,jrn->rij", slopes, slopes) / noise[:, None, None]
    pull = np.einsum("irn,rn->ri", slopes, gap) / noise[:, None]
    square += np.eye(6) / sigma**2
    pull -= shifts / sigma**2
    step = np.linalg.solve(square, pull[..., None])[..., 0]
    return np.clip(shifts + step, -FARTHEST * sigma, FARTHEST * sigma)


def _kept(rows: FitSet, fitted: FittedRoom | FittedMesh) -> FittedRoom | FittedMesh:
    """Return the room with the paths of these rows listed once."""
    if isinstance(fitted, FittedRoom):
        return fitted
    held = fitted.room.free().holding(rows.emitters, rows.listeners, rows.n_samples)
    return replace(fitted, room=held)


def _quick(rows: FitSet, fitted: FittedRoom | FittedMesh) -> FloatArray:
    predicted = fitted.predict(rows.emitters, rows.listeners, rows.n_samples)
    return without_slow(predicted, rows.sample_rate)
