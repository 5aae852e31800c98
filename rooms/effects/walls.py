"""Walls with an admittance or layers: what they reflect depends on the angle."""

import numpy as np

from rir.physics import decibels
from rooms.effects.effect import Effect, Need, Tolerance, judged
from rooms.scene import Scene
from rooms.sound import Budget, Sound
from rooms.walls import angled_walls

__all__ = ["WALLS"]

_COSINES = np.array([0.17, 0.5, 0.87, 1.0])
"""Angles of 80, 60, 30 and 0 degrees, between which rooms reflect most."""

_LOUDEST_DB = 20.0
"""Where a wall swallows an angle whole, others are what is heard."""

_COST_S = 4e-3
"""Spherical factors and echoes of 62 paths, and images at their angles."""


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Need:
    """Judge by how far reflections at single angles are from those of diffuse sound."""
    del budget
    if not scene.walls:
        return Need(False, "no surface states an admittance or layers")
    change = angled_walls(scene)
    strays = []
    for row, wall in scene.walls.items():
        kept = change.means(wall, _COSINES) ** 2
        diffuse = np.maximum(1 - scene.absorption[row], 1e-3)
        strays.append(np.abs(decibels(np.maximum(kept, 1e-3) / diffuse)).max())
    level = min(float(max(strays)), _LOUDEST_DB)
    why = (
        f"{len(scene.walls)} of {len(scene.absorption)} surfaces answer by angle, up to"
        f" {level:.1f} dB from what they do to diffuse sound"
    )
    return judged(tolerance, {"level_db": level}, why, _COST_S)


def apply(scene: Scene, sound: Sound) -> None:
    """Let those surfaces reflect by the angle of incidence."""
    if scene.walls:
        # what they reflect comes before what others take of it
        sound.bounce_changes.insert(0, angled_walls(scene))


WALLS = Effect("walls", "reflection by angle (admittance, layers)", needed, apply)
