"""The direct sound: 1/d at distance d."""

import numpy as np

from rooms.effects.effect import Effect, Tolerance, Verdict
from rooms.scene import Scene
from rooms.sound import Arrivals, Budget, Sound

__all__ = ["DIRECT", "NEAREST"]

NEAREST = 0.01
"""Distances below this [m] count as this: no transducer is a point."""


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Verdict:
    """Answer yes: nothing can stand for the direct sound."""
    del scene, budget, tolerance
    return Verdict(True, "always", {"level_db": float("inf")})


def apply(scene: Scene, sound: Sound) -> None:
    """Add one arrival per listener."""
    bands = len(scene.bands)
    for index, listener in enumerate(sound.listeners):
        way = listener.position - sound.emitter.position
        distance = float(np.linalg.norm(way))
        facing = way / distance if distance > 0 else sound.emitter.forward
        sound.arrivals[index].append(
            Arrivals(
                np.array([distance / scene.speed_of_sound]),
                np.full((1, bands), 1 / max(distance, NEAREST)),
                facing[None],
                -facing[None],
                np.zeros(1, dtype=np.int64),
            )
        )


DIRECT = Effect("direct", "the straight way", needed, apply)
