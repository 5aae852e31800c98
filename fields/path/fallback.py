"""What is answered where no geometry explains the room: the nearest response.

The nearest stored response over both orders of the ends, moved in time so that
its direct sound stands where the poses say. Symmetric by
construction; never better than the data.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fields.path.fitset import FitSet
from rir import Poses

__all__ = ["NearestRows"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class NearestRows:
    """Hold rows to answer from.

    Parameters
    ----------
    responses : ndarray, shape (rows, n)
        Stored responses.
    emitters, listeners : ndarray, shape (rows, 3)
        Their ends.
    samples_a_metre : float
        Sample rate over speed of sound.
    """

    responses: NDArray[np.float32]
    emitters: FloatArray
    listeners: FloatArray
    samples_a_metre: float

    @classmethod
    def of(cls, rows: FitSet) -> "NearestRows":
        """Keep the rows of a set."""
        return cls(
            rows.responses.astype(np.float32),
            rows.emitters.positions,
            rows.listeners.positions,
            rows.sample_rate / rows.speed_of_sound,
        )

    def predict(self, emitters: Poses, listeners: Poses, n_samples: int) -> FloatArray:
        """Return the nearest rows, re-timed, shape (queries, n_samples)."""
        from scipy.spatial import KDTree

        ends = np.hstack([self.emitters, self.listeners])
        turned = np.hstack([self.listeners, self.emitters])
        asked = np.hstack([emitters.positions, listeners.positions])
        tree = KDTree(np.vstack([ends, turned]))
        _, rows = tree.query(asked)
        rows = np.asarray(rows) % len(ends)
        here = np.linalg.norm(emitters.positions - listeners.positions, axis=1)
        there = np.linalg.norm(self.emitters[rows] - self.listeners[rows], axis=1)
        move = np.round((here - there) * self.samples_a_metre).astype(int)
        out = np.zeros((len(rows), n_samples))
        for query, row in enumerate(rows):
            out[query] = _moved(self.responses[row], int(move[query]), n_samples)
        return out


def _moved(response: NDArray[np.float32], by: int, n_samples: int) -> FloatArray:
    out = np.zeros(n_samples)
    first, last = max(by, 0), min(n_samples, len(response) + by)
    if last > first:
        out[first:last] = response[first - by : last - by]
    return out
