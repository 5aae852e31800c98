"""Air absorption after ISO 9613-1."""

import numpy as np

from rooms.effects.effect import Effect, Tolerance, Verdict
from rooms.scene import Scene
from rooms.sound import Budget, Sound

__all__ = ["AIR"]


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Verdict:
    """Judge by the attenuation over the response and the change of decay."""
    inside = scene.bands < budget.sample_rate / 2
    loss_db = scene.air.absorption(scene.bands)[inside]
    way = scene.speed_of_sound * budget.duration
    level = float(loss_db.max() * way)
    with_air, without = scene.eyring_t60(), scene.eyring_t60(air=False)
    with np.errstate(invalid="ignore"):
        change = float(np.nan_to_num(100 * (1 - with_air / without))[inside].max())
    on = level > tolerance.level_db or change > tolerance.reverberation_percent
    reason = f"{level:.1f} dB over {way:.0f} m in the highest octave"
    errors = {"level_db": level, "reverberation_percent": change}
    return Verdict(on, reason, errors)


def apply(scene: Scene, sound: Sound) -> None:
    """Let every arrival fade with the way it has gone."""
    sound.air_loss = scene.air_loss


AIR = Effect("air", "absorption by the air (ISO 9613-1)", needed, apply)
