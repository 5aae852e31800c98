"""Scattering: rough surfaces take energy from the mirrors and spread it."""

import numpy as np

from rooms.effects.effect import Effect, Tolerance, Verdict, judged
from rooms.predict import predicted_errors
from rooms.scene import Scene
from rooms.sound import Budget, Sound

__all__ = ["SCATTERING"]


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Verdict:
    """Judge by what mirrors alone would do to decay, clarity and level."""
    if not np.any(scene.scattering):
        return Verdict(False, "no surface scatters")
    errors = predicted_errors(
        scene, budget.duration, budget.sample_rate, scattering=False
    )
    areas = scene.geometry.areas
    mean = float((areas @ scene.scattering / areas.sum()).max())
    return judged(tolerance, errors, f"surfaces scatter up to {mean:.2f}")


def apply(scene: Scene, sound: Sound) -> None:
    """Take the scattered share out of every mirror reflection."""
    if np.any(scene.scattering):
        sound.scattering = scene.scattering


SCATTERING = Effect("scattering", "diffuse share of each reflection", needed, apply)
