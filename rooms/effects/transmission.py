"""Transmission: what passes straight through thin surfaces.

Every surface crossed takes its own share, so a slab modelled by two faces has the
square root of its transmission on each.
"""

import numpy as np

from rir.physics import decibels
from rooms.effects.effect import Effect, Need, Tolerance, judged
from rooms.scene import Scene
from rooms.sound import Arrivals, Budget, Sound

__all__ = ["TRANSMISSION"]

_BENT_DB = 14.0
"""Sound bent around one edge arrives about so much below free sound [dB]."""


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Need:
    """Judge by the most transparent surface against sound bent around an edge."""
    del budget
    if scene.geometry.lattice:
        return Need(False, "no surface stands inside the six walls of a box")
    most = float(scene.transmission.max(initial=0.0))
    if most == 0:
        return Need(False, "no surface lets sound through")
    level = float(decibels(1 + most * 10 ** (_BENT_DB / 10)))
    why = f"surfaces pass up to {decibels(most):.0f} dB"
    return judged(tolerance, {"level_db": level}, why, 1e-4)


def apply(scene: Scene, sound: Sound) -> None:
    """Add the straight way through every surface between the ends."""
    if scene.geometry.lattice or not np.any(scene.transmission):
        return
    from rooms.mesh.crossings import find_crossings

    way = sound.listeners.positions - sound.emitter.position
    distance = np.linalg.norm(way, axis=1)
    places = sound.emitter.position, sound.listeners.positions
    hit = find_crossings(scene.geometry.mesh, *places)
    through = hit.any(axis=1) & (distance > 0)
    with np.errstate(divide="ignore"):
        loss = np.log(scene.transmission[scene.geometry.mesh.face_surface]) / 2
    gain = np.exp(np.where(hit[through][..., None], loss, 0.0).sum(axis=1))
    facing = way[through] / distance[through, None]
    sound.arrivals.append(
        Arrivals(
            listener=np.nonzero(through)[0],
            delay=distance[through] / scene.speed_of_sound,
            gain=gain / distance[through, None],
            departure=facing,
            arrival=-facing,
            order=np.zeros(int(through.sum()), dtype=np.int64),
        )
    )


TRANSMISSION = Effect("transmission", "through thin surfaces", needed, apply)
