"""Late sound that obeys reciprocity: plane waves with twins, the same both ways.

Both ends count alike, and neighbouring places get related tails, so an end that moves
makes no jumps.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

WAVES_A_SAMPLE = 0.5  # and their twins: one arrival a sample, so that no gap is audible
MARGIN_M = 6.0  # places up to so far from the middle of a room get waves at all times


@dataclass(frozen=True, eq=False)
class PlaneWaves:
    """Hold the plane waves of a room.

    Parameters
    ----------
    seed : int
        Of the waves.
    center : numpy.ndarray
        Shape (3,), metres; waves pass it at their starts.
    samples_a_metre : float
        Sample rate over speed of sound.
    n_samples : int
        Length of a response.
    """

    seed: int
    center: np.ndarray
    samples_a_metre: float
    n_samples: int

    def __call__(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Return white sound between places, (rows, 3) each: (rows, n_samples).

        Nothing arrives before the direct sound would.
        """
        out = np.zeros((len(first), self.n_samples))
        ends = [(one - self.center) * self.samples_a_metre for one in (first, second)]
        onset = np.linalg.norm(first - second, axis=1) * self.samples_a_metre
        starts, signs, leaving, arriving = self._waves()
        add_waves(ends[0], ends[1], starts, signs, leaving, arriving, onset, out)
        return out

    def _waves(self) -> tuple[np.ndarray, ...]:
        rng = np.random.default_rng(self.seed)
        margin = 2 * MARGIN_M * self.samples_a_metre
        span = self.n_samples + 2 * margin
        count = int(np.ceil(WAVES_A_SAMPLE * span))
        starts = (np.arange(count) + rng.random(count)) / count * span - margin
        signs = rng.choice([-1.0, 1.0], count)
        leaving, arriving = (_directions(rng, count) for _ in range(2))
        return starts, signs, leaving, arriving


def _directions(rng: np.random.Generator, count: int) -> np.ndarray:
    towards = rng.standard_normal((count, 3))
    return towards / np.linalg.norm(towards, axis=1, keepdims=True)


@njit(cache=True)
def add_waves(first, second, starts, signs, leaving, arriving, onset, out):
    """Add plane waves and their twins to rows of samples.

    `first` and `second` are ends in samples of travel, (rows, 3); a wave starts at
    `starts`, leaves along `leaving` and arrives along `arriving`. Its twin does so
    the other way round, and both are added in order of time, so that swapped ends
    give the same bits.
    """
    rows, length = out.shape
    for row in range(rows):
        x, y = first[row], second[row]
        for wave in range(len(starts)):
            u, v = leaving[wave], arriving[wave]
            ux = u[0] * x[0] + u[1] * x[1] + u[2] * x[2]
            vy = v[0] * y[0] + v[1] * y[1] + v[2] * y[2]
            vx = v[0] * x[0] + v[1] * x[1] + v[2] * x[2]
            uy = u[0] * y[0] + u[1] * y[1] + u[2] * y[2]
            one = starts[wave] + (ux + vy)
            other = starts[wave] + (vx + uy)
            early, late = min(one, other), max(one, other)
            for turn in range(2):
                time = early if turn == 0 else late
                place = int(np.floor(time))
                if time < onset[row] or place + 1 >= length:
                    continue
                part = time - place
                out[row, place] += signs[wave] * (1 - part)
                out[row, place + 1] += signs[wave] * part
