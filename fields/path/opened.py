"""Try whether a room is more than a box: the walls that stand between poses."""

from dataclasses import dataclass, field

import numpy as np

from fields.path.direct import DirectSound
from fields.path.fitset import FitSet
from fields.path.outline import find_outline
from fields.path.polyhedral import FittedMesh, fit_polyhedron
from fields.path.shoebox import FittedRoom
from rir import GainPattern

__all__ = ["Opened", "open_box"]

WORTH_OPENING = 0.02
"""A box that leaves less of the energy is one."""
BETTER, EXPLAINING = 0.9, 0.1
"""Room for error left, or part of what the box explains gained."""
JUDGED_ROWS = 120
FEW_ROWS, CLEAR = 30, 1e-3
"""A few rows show that nothing is left to look for."""


@dataclass(frozen=True, eq=False)
class Opened:
    """Hold a room of flat faces, None where the box stands, and what to tell."""

    fitted: FittedMesh | None
    alarms: list[str] = field(default_factory=list)


def open_box(
    rows: FitSet,
    direct: DirectSound,
    fitted: FittedRoom,
    reach_s: float,
    listening: GainPattern | None = None,
) -> Opened:
    """Look for walls inside a fitted box and fit the room they make.

    The room is only taken where it tells the rows clearly better than the box.
    """
    if rows.n_places < 2 or left_over(rows.spread(FEW_ROWS), fitted) < CLEAR:
        return Opened(None)
    few = rows.spread(JUDGED_ROWS)
    before = left_over(few, fitted)
    if before < WORTH_OPENING:
        return Opened(None)
    outline = find_outline(rows, direct, fitted)
    if outline is None:
        return Opened(None)
    loose = [
        f"a wall may stand inside the room, {_worded(plane.row)}, but where it ends "
        "was not heard; it is left out"
        for plane in outline.found
    ]
    if outline.shape is None:
        return Opened(None, loose)
    reach_m = reach_s * rows.speed_of_sound
    try:
        opened = fit_polyhedron(rows, direct, outline.shape, reach_m, listening)
    except np.linalg.LinAlgError:
        return Opened(None, loose)
    after = left_over(few, opened)
    if after > BETTER * before and before - after < EXPLAINING * (1 - before):
        return Opened(None, loose)
    return Opened(opened, [] if outline.closed else [OPEN])


OPEN = "the walls found leave the room open: some were not heard, none is invented"


def left_over(rows: FitSet, fitted: FittedRoom | FittedMesh) -> float:
    """Return the part of the rows' energy that paths do not tell."""
    told = fitted.predict(rows.emitters, rows.listeners, rows.n_samples)
    power = max(float((rows.responses**2).sum()), 1e-300)
    return float(((rows.responses - told) ** 2).sum()) / power


def _worded(plane: np.ndarray) -> str:
    """Say where a plane stands: along an axis, or by normal and offset."""
    axis = int(np.argmax(np.abs(plane[:3])))
    if abs(plane[axis]) > 0.999:
        return f"{'xyz'[axis]} = {plane[3] / plane[axis]:.2f} m"
    normal = ", ".join(f"{value:.2f}" for value in plane[:3])
    return f"normal ({normal}) at {plane[3]:.2f} m"
