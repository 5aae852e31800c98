"""What a room is found in: responses in double precision and the poses of the ends."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rir import Poses
from rir.arrays import FloatArray, IntArray

__all__ = ["FitSet", "place_numbers"]

SAME_PLACE_M = 1e-3
"""Poses are stated in millimetres at best: nearer ones are one place."""


@dataclass(frozen=True, eq=False)
class FitSet:
    """Hold rows of responses with their poses.

    Parameters
    ----------
    responses : ndarray
        Shape (rows, n_samples); a direct sound is about 1/distance.
    emitters, listeners : Poses
        One pose a row.
    sample_rate : float
        Hertz.
    speed_of_sound : float
        At the temperature of the air, metres per second.
    places : ndarray
        Number of the emitter's place, shape (rows,).
    blocks : ndarray
        Number of the recording block, shape (rows,); all 0 when unknown.
    temperatures : ndarray, optional
        Logged air temperature of each row, degrees Celsius; NaN where unknown.
    """

    responses: FloatArray
    emitters: Poses
    listeners: Poses
    sample_rate: float
    speed_of_sound: float
    places: IntArray
    blocks: IntArray
    temperatures: FloatArray | None = None

    def __len__(self) -> int:
        return len(self.responses)

    @property
    def n_samples(self) -> int:
        """Length of a response."""
        return self.responses.shape[1]

    @property
    def n_places(self) -> int:
        """Number of emitter places."""
        return int(self.places.max()) + 1 if len(self.places) else 0

    @property
    def distances(self) -> FloatArray:
        """Length of each direct path, shape (rows,), metres."""
        gap = self.emitters.positions - self.listeners.positions
        return np.linalg.norm(gap, axis=1)

    def rows(self, index: NDArray) -> "FitSet":
        """Return some rows; places keep numbers without gaps."""
        _, places = np.unique(self.places[index], return_inverse=True)
        return replace(
            self,
            responses=self.responses[index],
            emitters=self.emitters[index],
            listeners=self.listeners[index],
            places=places.reshape(-1).astype(np.int64),
            blocks=self.blocks[index],
            temperatures=None
            if self.temperatures is None
            else self.temperatures[index],
        )

    def spread(self, count: int) -> "FitSet":
        """Return at most `count` rows, drawn evenly over the emitter places."""
        if len(self) <= count:
            return self
        order = np.argsort(_turns(self.places), kind="stable")
        return self.rows(np.sort(order[:count]))

    def spread_rest(self, count: int) -> "FitSet":
        """Return the rows that :meth:`spread` leaves out."""
        order = np.argsort(_turns(self.places), kind="stable")
        return self.rows(np.sort(order[count:]))

    def cut(self, n_samples: int) -> "FitSet":
        """Return the rows' first samples."""
        return replace(self, responses=self.responses[:, :n_samples])


def place_numbers(positions: FloatArray) -> IntArray:
    """Give each distinct place of poses a number, shape (rows,)."""
    rounded = np.round(positions / SAME_PLACE_M).astype(np.int64)
    _, numbers = np.unique(rounded, axis=0, return_inverse=True)
    return numbers.reshape(-1).astype(np.int64)


def _turns(places: IntArray) -> FloatArray:
    """Return for each row how far through its emitter's rows it stands.

    Bit-reversed ranks, so that any first part of the order is spread over all
    rows of every emitter.
    """
    ranks = np.empty(len(places))
    for place in np.unique(places):
        mine = np.flatnonzero(places == place)
        steps = np.arange(len(mine))
        ranks[mine] = np.argsort(np.argsort((steps * 0.6180339887498949) % 1.0))
    return ranks
