"""Gain patterns: devices radiate and listen more strongly in some directions."""

import numpy as np

from rir import GainPattern
from rir.physics import decibels
from rooms.effects.effect import Effect, Need, Tolerance, judged
from rooms.scene import Scene
from rooms.sound import Budget, Sound

__all__ = ["PATTERNS"]


def _deviation_db(pattern: GainPattern) -> float:
    """Return the largest deviation from omni over 200 directions, at most 60 dB."""
    turn = np.arange(200) + 0.5
    z, azimuth = 1 - turn / 100, turn * np.pi * (3 - np.sqrt(5))
    flat = np.sqrt(1 - z**2)
    grid = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), z], axis=1)
    level = decibels(np.maximum(pattern.gain(grid) ** 2, 1e-6))
    return float(np.abs(level).max())


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Need:
    """Judge by the larger deviation of the two patterns from omni."""
    worst = max(_deviation_db(scene.emitter_gain), _deviation_db(scene.listener_gain))
    if worst < 1e-6:
        return Need(False, "both patterns are omnidirectional")
    why = f"gains stray up to {worst:.1f} dB from omni"
    return judged(tolerance, {"level_db": worst}, why, 6e-7 * budget.n_samples)


def apply(scene: Scene, sound: Sound) -> None:
    """Weigh every arrival by both patterns; omni patterns stay free of cost."""
    if not (scene.emitter_gain.is_omni and scene.listener_gain.is_omni):
        sound.patterns = (scene.emitter_gain, scene.listener_gain)


PATTERNS = Effect("patterns", "gain patterns of emitter and listener", needed, apply)
