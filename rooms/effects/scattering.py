"""Scattering: rough surfaces take energy from the mirrors and spread it."""

from dataclasses import replace

import numpy as np

from rooms.effects.effect import Effect, Need, Tolerance, judged
from rooms.predict import ODD_SHAPE, predicted_errors, scattered_share
from rooms.reflection import ScatteredShare
from rooms.scene import Scene
from rooms.sound import Budget, Sound

__all__ = ["SCATTERING"]


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Need:
    """Judge by what mirrors alone would do to decay, clarity and level."""
    if not np.any(scene.scattering):
        return Need(False, "no surface scatters")
    errors = predicted_errors(scene, budget.duration, budget.sample_rate, smooth)
    share = scattered_share(scene, budget.duration)
    # what scatters arrives elsewhere in time: the fine structure of that share is
    # another, and an octave's level and slope follow with a few dozen degrees of
    # freedom
    errors["level_db"] = max(errors["level_db"], 2 * share**0.5)
    errors["clarity_db"] = max(errors["clarity_db"], errors["level_db"])
    boxed = scene.geometry.lattice
    errors["reverberation_percent"] = max(
        errors["reverberation_percent"], (25 if boxed else ODD_SHAPE) * share**0.5
    )
    return judged(tolerance, errors, f"{100 * share:.1f} % of the sound is scattered")


def smooth(scene: Scene) -> Scene:
    """Return the scene with surfaces that mirror only."""
    return replace(scene, scattering=np.zeros_like(scene.scattering))


def apply(scene: Scene, sound: Sound) -> None:
    """Take the scattered share out of every mirror reflection."""
    if np.any(scene.scattering):
        sound.bounce_changes.append(ScatteredShare(scene.scattering))


SCATTERING = Effect(
    "scattering", "diffuse share of each reflection", needed, apply, without=smooth
)
