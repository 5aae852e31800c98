"""Which rows' direct sounds arrived: sight between poses, read from responses.

A direct sound is as loud as the emitter is towards the listener, or it is not there.
The emitter's pattern is not known beforehand: it is what the loudest rows in each
direction agree on, and rows far below it were hidden by something.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inverse.rows.direct import DirectSound
from inverse.rows.directivity import aimed_offsets
from inverse.rows.fitset import FitSet
from inverse.rows.regions import HIDDEN, SEEN, Regions, direct_levels, find_regions
from rir.arrays import FloatArray

__all__ = ["Sight", "read_sight"]

ORDER, ROWS_A_HARMONIC = 2, 12
"""Of the pattern, and rows for each of its numbers: half of them may be hidden."""
TURNS = 8  # in which hidden rows are left out; their set is settled after some five
RIDGE = 0.3
"""A third of a row, on all but the mean: directions without rows stay average."""
FAINT = 0.15  # rows this far below the loudest direction are in doubt
UPPER = 0.75
"""Quantile that stands for free levels, where up to half of the rows are hidden."""


@dataclass(frozen=True, eq=False)
class Sight:
    """Hold which pairs of places see each other."""

    bits: FloatArray
    """1 seen, 0 hidden, NaN in doubt. Shape (rows,)."""
    free: FloatArray
    """Level of each direct sound times distance with nothing in its way, by the loudest
    rows of its direction. Shape (rows,)."""

    def regions(self, rows: FitSet) -> Regions:
        """Return the rooms that explain which places see each other."""
        return find_regions(
            rows.emitters.positions, rows.listeners.positions, self.bits
        )


def read_sight(
    rows: FitSet, direct: DirectSound, speed_of_sound: float | None = None
) -> Sight:
    """Read which direct sounds arrived at the delay and level the poses say.

    Parameters
    ----------
    rows : FitSet
        Measured rows.
    direct : DirectSound
        What their direct sounds have in common; its latency is used.
    speed_of_sound : float, optional
        Metres per second; what the temperature says when left out.
    """
    speed = speed_of_sound or rows.speed_of_sound
    late = direct.latency_s * speed
    reach = rows.distances
    level = direct_levels(rows.responses, reach + late, rows.sample_rate, speed)
    level = level * reach / np.maximum(reach + late, 1e-6)
    heard = np.isfinite(level)
    bits = np.full(len(rows), np.nan)
    if not heard.any() or not level[heard].any():
        return Sight(bits, np.zeros(len(rows)))
    free = _envelope(_directions(rows), np.where(heard, level, 0.0), heard)
    clear = heard & (free > FAINT * np.quantile(free[heard], UPPER))
    share = np.where(clear, level / np.maximum(free, 1e-300), 0.5)
    bits[clear & (share > SEEN)] = 1.0
    bits[clear & (share < HIDDEN)] = 0.0
    return Sight(bits, free)


def _directions(rows: FitSet) -> FloatArray:
    """Return harmonics of where listeners stand in their emitter's frame."""
    from rir.harmonics import evaluate_harmonics

    order = ORDER
    while order > 0 and len(rows) < ROWS_A_HARMONIC * (order + 1) ** 2:
        order -= 1
    offsets = aimed_offsets(rows.emitters, rows.listeners)
    away = np.maximum(np.linalg.norm(offsets, axis=1, keepdims=True), 1e-6)
    return evaluate_harmonics(offsets / away, order)


def _envelope(
    basis: FloatArray, level: FloatArray, heard: NDArray[np.bool_]
) -> FloatArray:
    """Return levels that the loudest rows of each direction agree on.

    Hidden rows only ever lie below: those that do are left out, turn by turn.
    """
    free = np.full(len(level), float(np.quantile(level[heard], UPPER)))
    weight = np.where(heard, np.minimum(level / free, 1.0) ** 2, 0.0)
    for _ in range(TURNS):
        square = (basis * weight[:, None]).T @ basis
        square[np.diag_indices_from(square)] += (
            RIDGE * np.r_[0.0, np.ones(len(square) - 1)]
        )
        pull = (basis * weight[:, None]).T @ level
        free = np.maximum(basis @ np.linalg.lstsq(square, pull, rcond=None)[0], 0.0)
        floor = 0.1 * float(np.quantile(free[heard], UPPER))
        below = 0.5 * (SEEN + HIDDEN) * free
        weight = np.where(heard & (level > below) & (free > floor), 1.0, 0.0)
        weight[heard & (free <= floor)] = 0.1
        if not weight.any():
            break
    return free
