"""Air absorption after ISO 9613-1."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from rir.air import Air
from rir.arrays import FloatArray
from rooms.effects.effect import Effect, Need, Tolerance, judged
from rooms.predict import predicted_errors
from rooms.scene import Scene
from rooms.sound import Budget, Sound

__all__ = ["AIR"]


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Need:
    """Judge by the predicted change of decay, clarity and level."""
    errors = predicted_errors(scene, budget.duration, budget.sample_rate, lossless)
    heard = scene.bands < budget.sample_rate / 2
    loss = scene.air.absorption(scene.bands)[heard].max(initial=0.0)
    across = float(np.linalg.norm(scene.geometry.size))
    errors["level_db"] = max(errors["level_db"], float(loss) * across)
    why = f"{100 * loss:.1f} dB per 100 m in the highest octave"
    return judged(tolerance, errors, why, 3e-7 * budget.n_samples)


class LosslessAir(Air):
    """Air that takes nothing from sound."""

    def absorption(self, frequencies: ArrayLike) -> FloatArray:
        """Return no attenuation."""
        return np.zeros_like(np.asarray(frequencies, dtype=np.float64))


def lossless(scene: Scene) -> Scene:
    """Return the scene in air of the same temperature that takes nothing."""
    return replace(scene, air=LosslessAir(**scene.air.model_dump()))


def apply(scene: Scene, sound: Sound) -> None:
    """Let every arrival fade with the way it has gone."""
    sound.air_loss = scene.air_loss


AIR = Effect(
    "air", "absorption by the air (ISO 9613-1)", needed, apply, without=lossless
)
