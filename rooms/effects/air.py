"""Air absorption after ISO 9613-1."""

import numpy as np

from rooms.effects.effect import Effect, Need, Tolerance, judged
from rooms.predict import predicted_errors
from rooms.scene import Scene
from rooms.sound import Budget, Sound

__all__ = ["AIR"]


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Need:
    """Judge by the predicted change of decay, clarity and level."""
    errors = predicted_errors(scene, budget.duration, budget.sample_rate, air=False)
    heard = scene.bands < budget.sample_rate / 2
    loss = scene.air.absorption(scene.bands)[heard].max(initial=0.0)
    across = float(np.linalg.norm(scene.geometry.size))
    errors["level_db"] = max(errors["level_db"], float(loss) * across)
    why = f"{100 * loss:.1f} dB per 100 m in the highest octave"
    return judged(tolerance, errors, why, 3e-7 * budget.n_samples)


def apply(scene: Scene, sound: Sound) -> None:
    """Let every arrival fade with the way it has gone."""
    sound.air_loss = scene.air_loss


AIR = Effect("air", "absorption by the air (ISO 9613-1)", needed, apply)
