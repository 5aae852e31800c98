"""The nearest measured response, where no geometry explains the room.

The nearest stored response over both orders of the ends, moved in time so that
its direct sound stands where the poses say. Symmetric by
construction; never better than the data.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inverse.blend.aligned import squares
from inverse.rows.fitset import FitSet
from inverse.rows.proof import MOST_ROWS, prove
from rir import Poses
from rir.arrays import FloatArray

__all__ = ["NearestRows"]

SAME_M = 0.05  # places so near are one place, poses told by hand allowed for
LEAST_ROWS = 8  # fewer rows do not decide whether re-timing helps; it is then done


@dataclass(frozen=True, eq=False)
class NearestRows:
    """Hold measured rows to answer from.

    Parameters
    ----------
    responses : ndarray, shape (rows, n)
        Stored responses.
    emitters, listeners : ndarray, shape (rows, 3)
        Their ends.
    samples_a_metre : float
        Sample rate over speed of sound.
    retimed : bool
        Whether a row is moved to the direct path of the places asked for.
    """

    responses: NDArray[np.float32]
    emitters: FloatArray
    listeners: FloatArray
    samples_a_metre: float
    retimed: bool = True

    @classmethod
    def of(cls, rows: FitSet) -> "NearestRows":
        """Keep rows; re-time them where that lowers errors at places left out."""
        kept = cls(
            rows.responses.astype(np.float32),
            rows.emitters.positions,
            rows.listeners.positions,
            rows.sample_rate / rows.speed_of_sound,
        )
        still = replace(kept, retimed=False)
        few = rows.spread(MOST_ROWS)
        if len(few) < LEAST_ROWS or not few.responses.any():
            return kept
        tried = {"kept": kept.left_out(few), "still": still.left_out(few)}
        return kept if prove(few, tried).best == "kept" else still

    def predict(self, emitters: Poses, listeners: Poses, n_samples: int) -> FloatArray:
        """Return the nearest rows, shape (queries, n_samples)."""
        from scipy.spatial import KDTree

        ends = np.hstack([self.emitters, self.listeners])
        turned = np.hstack([self.listeners, self.emitters])
        asked = np.hstack([emitters.positions, listeners.positions])
        _, rows = KDTree(np.vstack([ends, turned])).query(asked)
        return self._answer(asked, np.asarray(rows) % len(ends), n_samples)

    def left_out(self, rows: FitSet) -> FloatArray:
        """Return predictions for measured rows by rows of other emitter places.

        With a single place, by rows whose listener is elsewhere.
        """
        first, second = rows.emitters.positions, rows.listeners.positions
        own, unheard = self.emitters, first
        if rows.n_places < 2:
            own, unheard = self.listeners, second
        gaps = np.minimum(
            squares(first, self.emitters) + squares(second, self.listeners),
            squares(first, self.listeners) + squares(second, self.emitters),
        )
        gaps[squares(unheard, own) < SAME_M**2] = np.inf
        return self._answer(
            np.hstack([first, second]), np.argmin(gaps, axis=1), rows.n_samples
        )

    def _answer(
        self, asked: FloatArray, rows: NDArray[np.intp], n_samples: int
    ) -> FloatArray:
        here = np.linalg.norm(asked[:, :3] - asked[:, 3:], axis=1)
        there = np.linalg.norm(self.emitters[rows] - self.listeners[rows], axis=1)
        move = np.round((here - there) * self.samples_a_metre).astype(int)
        out = np.zeros((len(rows), n_samples))
        for query, row in enumerate(rows):
            by = int(move[query]) if self.retimed else 0
            out[query] = _moved(self.responses[row], by, n_samples)
        return out


def _moved(response: NDArray[np.float32], by: int, n_samples: int) -> FloatArray:
    out = np.zeros(n_samples)
    first, last = max(by, 0), min(n_samples, len(response) + by)
    if last > first:
        out[first:last] = response[first - by : last - by]
    return out
