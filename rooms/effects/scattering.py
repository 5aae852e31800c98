"""Scattering: rough surfaces take energy from the mirrors and spread it."""

import numpy as np

from rir.physics import decibels
from rooms.effects.effect import Effect, Tolerance, Verdict
from rooms.scene import Scene
from rooms.sound import Budget, Sound

__all__ = ["SCATTERING"]


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Verdict:
    """Judge by the specular energy lost over the bounces inside the response."""
    areas = scene.geometry.areas
    mean = float((areas @ scene.scattering / areas.sum()).max())
    path = 4 * scene.geometry.volume / areas.sum()
    bounces = scene.speed_of_sound * budget.duration / path
    lost = float(np.minimum(-decibels(max(1 - mean, 1e-12)) * bounces, 200.0))
    on = lost > tolerance.level_db
    reason = f"up to {mean:.2f} at each of {bounces:.0f} bounces"
    return Verdict(on, reason, {"level_db": lost})


def apply(scene: Scene, sound: Sound) -> None:
    """Take the scattered share out of every mirror reflection."""
    if np.any(scene.scattering):
        sound.scattering = scene.scattering


SCATTERING = Effect("scattering", "diffuse share of each reflection", needed, apply)
