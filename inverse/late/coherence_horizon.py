"""How far into a response a path can be promised, and how well."""

from collections.abc import Callable

import numpy as np

__all__ = ["Uncertainty", "coherence_horizon", "predicted_coherence"]

from dataclasses import dataclass

LOST = 0.76
SOUND_SPEED_A_KELVIN = 0.0018
POSE_SD_M = 0.003
TEMPERATURE_SD_K = 0.1


@dataclass(frozen=True)
class Uncertainty:
    """Say what is not known exactly.

    Parameters
    ----------
    pose_sd_m : float
        Of each coordinate of each end, metres.
    temperature_sd_k : float
        Between recordings, kelvin.
    walls : callable, optional
        Standard deviation of a path's length that the walls' covariance gives,
        metres, of the length itself, metres.
    """

    pose_sd_m: float = POSE_SD_M
    temperature_sd_k: float = TEMPERATURE_SD_K
    walls: Callable[[np.ndarray], np.ndarray] | None = None

    def length_sd(self, lengths: np.ndarray) -> np.ndarray:
        """Return the standard deviation of path lengths, metres."""
        variance = 2 * self.pose_sd_m**2
        variance = (
            variance + (lengths * SOUND_SPEED_A_KELVIN * self.temperature_sd_k) ** 2
        )
        if self.walls is not None:
            variance = variance + np.asarray(self.walls(lengths)) ** 2
        return np.sqrt(variance)


def predicted_coherence(
    frequencies: np.ndarray,
    times: np.ndarray,
    speed_of_sound: float,
    doubt: Uncertainty,
) -> np.ndarray:
    """Return how much of the energy a path model can share with a measurement.

    Shape (frequencies, times): exp(-(k s)^2) with the wave number k and the
    standard deviation s of a path's length.
    """
    spread = doubt.length_sd(times * speed_of_sound)
    turns = 2 * np.pi * np.asarray(frequencies)[:, None] / speed_of_sound * spread
    return np.exp(-(turns**2))


def coherence_horizon(
    frequencies: np.ndarray,
    speed_of_sound: float,
    doubt: Uncertainty,
    *,
    longest_s: float = 10.0,
) -> np.ndarray:
    """Return until when waveforms can be promised at each frequency, seconds.

    There the error reaches half the energy (-3 dB): 2 (1 - exp(-(k s)^2 / 2)) =
    1/2, k s = 0.76.

    Examples
    --------
    >>> doubt = Uncertainty(pose_sd_m=0.003, temperature_sd_k=0.5)
    >>> coherence_horizon(np.array([1000.0]), 343.0, doubt).round(2)
    array([0.13])
    """
    times = np.geomspace(1e-4, longest_s, 2000)
    spread = doubt.length_sd(times * speed_of_sound)
    allowed = LOST * speed_of_sound / (2 * np.pi * np.asarray(frequencies))
    inside = np.searchsorted(np.maximum.accumulate(spread), allowed)
    return np.where(inside > 0, times[np.clip(inside - 1, 0, len(times) - 1)], 0.0)
