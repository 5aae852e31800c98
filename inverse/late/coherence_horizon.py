"""How far into a response a path can be promised, and how well."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

__all__ = ["Uncertainty", "predicted_coherence"]

SOUND_SPEED_A_KELVIN = 0.0018  # part of it: 0.61 m/s of 343 m/s
POSE_SD_M = 0.003  # of each coordinate, where nothing better is known: a careful rig
TEMPERATURE_SD_K = 0.1  # between takes, in a closed room within an hour


@dataclass(frozen=True)
class Uncertainty:
    """Say what is not known exactly."""

    pose_sd_m: float = POSE_SD_M
    """Of each coordinate of each end, metres."""
    temperature_sd_k: float = TEMPERATURE_SD_K
    """Between recordings, kelvin."""
    walls: Callable[[np.ndarray], np.ndarray] | None = None
    """Standard deviation of a path's length that the walls' covariance gives, metres,
    of the length itself, metres."""

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
    uncertainty: Uncertainty,
) -> np.ndarray:
    """Return how much of the energy a path model can share with a measurement.

    Shape (frequencies, times): exp(-(k s)^2) with the wave number k and the
    standard deviation s of a path's length.
    """
    spread = uncertainty.length_sd(times * speed_of_sound)
    turns = 2 * np.pi * np.asarray(frequencies)[:, None] / speed_of_sound * spread
    return np.exp(-(turns**2))
