"""Try whether a room is more than a box: the walls that stand between poses."""

from dataclasses import dataclass, field
from itertools import islice

import numpy as np

from inverse.paths.polyhedral import FittedMesh, fit_polyhedron
from inverse.paths.shoebox import FittedRoom
from inverse.rows.direct import DirectSound
from inverse.rows.fitset import FitSet
from inverse.rows.unexplained import unexplained_energy
from inverse.walls.outline import (
    Outline,
    find_clues,
    find_outline,
    other_outlines,
)
from rir import GainPattern

__all__ = ["InnerWalls", "find_inner_walls"]

WORTH_OPENING = 0.02  # a box that leaves less of the energy is one
BETTER, EXPLAINING = 0.9, 0.1
"""A tenth less error, or a tenth more of the energy, than the box (decision 0055)."""
SURELY = 0.5  # walls that one emitter speaks for must halve the rest (decision 0067)
MOST_TRIED = 4  # rooms with such walls: each costs a fit of the whole
JUDGED_ROWS = 120  # that judge: fewer scatter, more cost a rendering each
FEW_ROWS, CLEAR = 30, 1e-3  # so few rows show that nothing is left to look for


@dataclass(frozen=True, eq=False)
class InnerWalls:
    """Hold a room of flat faces, None where the box stands, and its alarms."""

    fitted: FittedMesh | None
    alarms: list[str] = field(default_factory=list)


def find_inner_walls(
    rows: FitSet,
    direct: DirectSound,
    fitted: FittedRoom,
    reach_s: float,
    listening: GainPattern | None = None,
) -> InnerWalls:
    """Look for walls inside a fitted box and fit the room they make.

    The room is only taken where it tells the rows clearly better than the box.
    """
    if rows.n_places < 2 or unexplained_energy(rows.spread(FEW_ROWS), fitted) < CLEAR:
        return InnerWalls(None)
    few = rows.spread(JUDGED_ROWS)
    before = unexplained_energy(few, fitted)
    if before < WORTH_OPENING:
        return InnerWalls(None)
    clues = find_clues(rows, direct, fitted)
    outline = find_outline(clues)
    if outline is None:
        return InnerWalls(None)
    judge = _Judge(rows, few, direct, reach_s * rows.speed_of_sound, listening)
    opened, after = judge.tried(outline)
    if after > BETTER * before and before - after < EXPLAINING * (1 - before):
        opened, after = None, before
    if opened is None or not outline.closed:
        for other in islice(other_outlines(clues), MOST_TRIED):
            tried, rest = judge.tried(other)
            # walls of one emitter must explain what nothing else does
            if rest < SURELY * after:
                return InnerWalls(tried)
    if opened is not None:
        return InnerWalls(opened, [] if outline.closed else [OPEN])
    return InnerWalls(
        None,
        [
            f"a wall may stand inside the room, {_worded(plane.row)}, but where it "
            "ends was not heard; it is left out"
            for plane in outline.found
        ],
    )


@dataclass(frozen=True, eq=False)
class _Judge:
    """Fit rooms and say what they leave over."""

    rows: FitSet
    few: FitSet
    direct: DirectSound
    reach_m: float
    listening: GainPattern | None

    def tried(self, outline: Outline) -> tuple[FittedMesh | None, float]:
        """Return the fitted room and the part of the energy it leaves."""
        if outline.shape is None:
            return None, np.inf
        shape = outline.shape
        try:
            fitted = fit_polyhedron(
                self.rows, self.direct, shape, self.reach_m, self.listening
            )
        except np.linalg.LinAlgError:
            return None, np.inf
        return fitted, unexplained_energy(self.few, fitted)


OPEN = "the walls found leave the room open: some were not heard, none is invented"


def _worded(plane: np.ndarray) -> str:
    """Say where a plane stands: along an axis, or by normal and offset."""
    axis = int(np.argmax(np.abs(plane[:3])))
    if abs(plane[axis]) > 0.999:
        return f"{'xyz'[axis]} = {plane[3] / plane[axis]:.2f} m"
    normal = ", ".join(f"{value:.2f}" for value in plane[:3])
    return f"normal ({normal}) at {plane[3]:.2f} m"
