"""The source's pulse and slow filter, fitted to paths as they are now."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TypeVar

from inverse.paths.box_fit import fit_bank
from inverse.paths.coloring import Coloring, Render, fit_coloring
from inverse.paths.mesh_room import MeshRoom
from inverse.paths.room import BoxRoom
from inverse.rows.fitset import FitSet
from rir.arrays import FloatArray

__all__ = ["polished", "without_coloring"]

Room = TypeVar("Room", BoxRoom, MeshRoom)
BANK_S = (0.003, 0.005)
"""Seconds before and after an arrival that a small loudspeaker's pulse fills."""
FIRST_TAPS = (20, 28)
"""Samples before and after an arrival; short until the paths are well known."""


def polished(
    rows: FitSet,
    room: Room,
    coloring: Coloring,
    turn: int,
    squares: Callable[[FitSet, Room, FloatArray], float],
) -> tuple[Coloring, Room]:
    """Fit the pulse, where that lowers `squares`, and then the coloring."""
    rest = without_coloring(rows, room, coloring)
    lead, tail = FIRST_TAPS
    if turn > 0:
        lead, tail = (round(part * rows.sample_rate) for part in BANK_S)
    bank = fit_bank(replace(rows, responses=rest), room, lead + tail, lead)
    better = replace(room, bank=bank)
    if squares(rows, better, rest) < squares(rows, room, rest):
        room = better
    return fit_coloring(rows.responses, _render(rows, room), rows.sample_rate), room


def without_coloring(
    rows: FitSet, room: BoxRoom | MeshRoom, coloring: Coloring
) -> FloatArray:
    """Return the rows without what the coloring adds to the room's paths."""
    return rows.responses - coloring.added(_render(rows, room), rows.n_samples)


def _render(rows: FitSet, room: BoxRoom | MeshRoom) -> Render:
    return partial(room.render, rows.emitters, rows.listeners)
