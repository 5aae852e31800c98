"""Walls with an admittance or layers: what they reflect depends on the angle."""

import numpy as np

from rir.physics import decibels
from rir.walls import pressure_factor
from rooms.effects.effect import Effect, Need, Tolerance, judged
from rooms.scene import Scene
from rooms.sound import Budget, Sound
from rooms.walls import angled_walls

__all__ = ["WALLS"]

_COSINES = np.array([0.17, 0.5, 0.87, 1.0])
"""Angles of 80, 60, 30 and 0 degrees, between which rooms reflect most."""

_COST_S = 4e-3
"""Spherical factors and echoes of 62 paths, and images at their angles."""


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Need:
    """Judge by how far reflections are from those of one absorption at all angles."""
    del budget
    if not scene.walls:
        return Need(False, "no surface states an admittance or layers")
    off = 0.0
    for row, wall in scene.walls.items():
        met = pressure_factor(wall, scene.bands, _COSINES[:, None])
        # magnitude and phase: beside direct sound both are heard
        plain = np.sqrt(1 - scene.absorption[row])
        off = max(off, float(np.abs(met - plain).max()))
    level = float(decibels((1 + off) ** 2))
    why = (
        f"{len(scene.walls)} of {len(scene.absorption)} surfaces answer by angle, which"
        f" changes sound near them by up to {level:.1f} dB"
    )
    return judged(tolerance, {"level_db": level}, why, _COST_S)


def apply(scene: Scene, sound: Sound) -> None:
    """Let those surfaces reflect by the angle of incidence."""
    if scene.walls:
        # what they reflect comes before what others take of it
        sound.bounce_changes.insert(0, angled_walls(scene))


WALLS = Effect("walls", "reflection by angle (admittance, layers)", needed, apply)
