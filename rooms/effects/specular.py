"""Mirror reflections: image sources."""

import numpy as np

from rir.physics import decibels
from rooms.effects.effect import Effect, Tolerance, Verdict
from rooms.effects.handover import handover_time
from rooms.geometry import Shoebox
from rooms.scene import Scene
from rooms.sound import Budget, Lattice, Sound

__all__ = ["SPECULAR"]

_ANY_ORDER = 1 << 30


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Verdict:
    """Judge by the energy of the strongest reflections against the direct sound."""
    del budget
    kept = float(1 - scene.absorption.min())
    level = float(decibels(1 + 6 * kept / 4))
    on = level > tolerance.level_db / 10
    reason = f"walls return up to {100 * kept:.0f} % of the energy"
    return Verdict(on, reason, {"level_db": level, "reverberation_percent": 100.0})


def apply(scene: Scene, sound: Sound) -> None:
    """Add every image whose sound arrives inside the response."""
    geometry, budget = scene.geometry, sound.budget
    if not isinstance(geometry, Shoebox) or not np.any(sound.reflection):
        return
    order = _ANY_ORDER if budget.max_order is None else budget.max_order
    until = handover_time(scene, sound)
    sound.lattice = Lattice(geometry.size, sound.reflection, order, until)


SPECULAR = Effect("specular", "mirror reflections (image sources)", needed, apply)
