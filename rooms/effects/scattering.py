"""Scattering: rough surfaces take energy from the mirrors and spread it."""

from dataclasses import replace

import numpy as np

from rooms.effects.effect import Effect, Need, Tolerance, judged
from rooms.energy_flow import energy_flow
from rooms.predict import equivalent_box, predicted_errors
from rooms.reflection import ScatteredShare
from rooms.scene import Scene
from rooms.sound import Budget, Sound

__all__ = ["SCATTERING"]

_ODD_SHAPE = 100.0
"""Percent of T60 per root of the scattered share in rooms that are not boxes: what
mirrors keep between hard walls of coupled rooms lasts longest of all."""


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Need:
    """Judge by what mirrors alone would do to decay, clarity and level."""
    if not np.any(scene.scattering):
        return Need(False, "no surface scatters")
    errors = predicted_errors(scene, budget.duration, budget.sample_rate, smooth)
    share = scattered_share(scene, budget)
    # what scatters arrives elsewhere in time: the fine structure of that share is
    # another, and an octave's level and slope follow with a few dozen degrees of
    # freedom
    errors["level_db"] = max(errors["level_db"], 2 * share**0.5)
    errors["clarity_db"] = max(errors["clarity_db"], errors["level_db"])
    boxed = scene.geometry.lattice
    errors["reverberation_percent"] = max(
        errors["reverberation_percent"], (25 if boxed else _ODD_SHAPE) * share**0.5
    )
    return judged(tolerance, errors, f"{100 * share:.1f} % of the sound is scattered")


def scattered_share(scene: Scene, budget: Budget) -> float:
    """Return the share of scattered energy 20 dB down the decay, worst octave."""
    box = equivalent_box(scene)
    longest = min(float(scene.eyring_t60().max()) / 3, budget.duration)
    flow = energy_flow(box, np.array([longest]), scattering=box.scattering)
    total = flow.images + flow.scattered
    return float(np.max(flow.scattered / np.maximum(total, 1e-300)))


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
