"""The direct sound: 1/d at distance d."""

import numpy as np
from numpy.typing import NDArray

from rooms.box_images import NEAREST
from rooms.effects.effect import Effect, Need, Tolerance
from rooms.scene import Scene
from rooms.sound import Arrivals, Budget, Sound

__all__ = ["DIRECT"]


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Need:
    """Answer yes: nothing can stand for the direct sound."""
    del scene, budget, tolerance
    return Need(True, "always", {"level_db": float("inf")})


def apply(scene: Scene, sound: Sound) -> None:
    """Add one arrival per listener."""
    way = sound.listeners.positions - sound.emitter.position
    distance = np.linalg.norm(way, axis=1)
    apart = distance > 0
    facing = np.where(apart[:, None], way, sound.emitter.forward)
    facing = facing / np.where(apart, distance, 1.0)[:, None]
    gain = 1 / np.maximum(distance, NEAREST)
    if not scene.geometry.lattice:
        gain = gain * _in_sight(scene, sound)
    sound.listed_order = max(sound.listed_order, 0)
    sound.arrivals.append(
        Arrivals(
            listener=np.arange(len(distance)),
            delay=distance / scene.speed_of_sound,
            gain=np.repeat(gain[:, None], len(scene.bands), axis=1),
            departure=facing,
            arrival=-facing,
            order=np.zeros(len(distance), dtype=np.int64),
        )
    )


def _in_sight(scene: Scene, sound: Sound) -> NDArray[np.bool_]:
    from rooms.mesh import find_paths

    places = sound.emitter.position, sound.listeners.positions
    seen = find_paths(scene.geometry.mesh, *places, max_order=0).listener
    return np.isin(np.arange(len(sound.listeners)), seen)


DIRECT = Effect("direct", "the straight way", needed, apply)
