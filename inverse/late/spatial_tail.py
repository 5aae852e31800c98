"""The waveform of late sound: plane waves with twins, the same both ways.

Both ends count alike, and neighbouring places get related tails, so an end that moves
makes no jumps.
"""

from dataclasses import dataclass

import numpy as np

__all__ = ["SpatialTail"]

WAVES_A_SAMPLE = 0.5  # and their twins: one arrival a sample, so that no gap is audible
MARGIN_M = 6.0  # places up to so far from the middle of a room get waves at all times


@dataclass(frozen=True, eq=False)
class SpatialTail:
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
        from inverse.late.spatial_tail_kernel import add_waves

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
