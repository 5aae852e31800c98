"""Gain patterns: devices radiate and listen more strongly in some directions."""

import numpy as np

from rir import GainPattern
from rir.physics import decibels
from rooms.effects.effect import Effect, Tolerance, Verdict
from rooms.scene import Scene
from rooms.sound import Budget, Sound

__all__ = ["PATTERNS"]


def _deviation_db(pattern: GainPattern) -> float:
    """Return how far the pattern strays from omni, in the mean over the sphere."""
    rest = pattern.coefficients.copy()
    rest[:, 0] -= np.sqrt(4 * np.pi)
    stray = np.sum(rest**2, axis=1) / (4 * np.pi)
    return float(decibels((1 + np.sqrt(stray.max())) ** 2))


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Verdict:
    """Judge by the larger deviation of the two patterns from omni."""
    del budget
    worst = max(_deviation_db(scene.emitter_gain), _deviation_db(scene.listener_gain))
    on = worst > tolerance.level_db
    word = "stray" if on else "stray only"
    reason = f"the patterns {word} {worst:.2f} dB from omni"
    return Verdict(on, reason, {"level_db": worst})


def apply(scene: Scene, sound: Sound) -> None:
    """Weigh every arrival by both patterns; omni patterns stay free of cost."""
    if not (scene.emitter_gain.is_omni and scene.listener_gain.is_omni):
        sound.patterns = (scene.emitter_gain, scene.listener_gain)


PATTERNS = Effect("patterns", "gain patterns of emitter and listener", needed, apply)
