"""Diffraction: sound bent around the edges of non-convex rooms."""

import numpy as np

from rir.physics import decibels
from rooms.effects.effect import Effect, Tolerance, Verdict, judged
from rooms.geometry import Shoebox
from rooms.scene import Scene
from rooms.sound import Arrivals, Budget, Sound

__all__ = ["DIFFRACTION"]


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Verdict:
    """Answer no exactly if no edge opens more than 180°; else judge by shadows."""
    del budget
    if isinstance(scene.geometry, Shoebox):
        return Verdict(False, "no edge of a box opens more than 180°")
    from rooms.diffraction import find_edges

    edges = len(find_edges(scene.geometry))  # pyright: ignore[reportArgumentType]
    if not edges:
        return Verdict(False, "no edge opens more than 180°")
    # behind one edge about -14 dB of the direct sound is left where nothing else is
    level = float(decibels(1 + 10**-0.5))
    return judged(tolerance, {"level_db": level}, f"{edges} edges cast shadows", 5e-3)


def apply(scene: Scene, sound: Sound) -> None:
    """Add the ways around one and two edges.

    The gain of a way is complex: within 45° of real, as sqrt(i w) is. It enters by
    its magnitude and the sign of its real part, which is exact at the boundaries
    of shadows and keeps levels elsewhere.
    """
    if isinstance(scene.geometry, Shoebox):
        return
    from rooms.diffraction import diffracted_paths

    ways = diffracted_paths(
        scene.geometry,  # pyright: ignore[reportArgumentType]
        sound.emitter.position,
        sound.listeners.positions,
        bands=scene.bands,
        speed_of_sound=scene.speed_of_sound,
        reflection=sound.reflection,
    )
    sound.arrivals.append(
        Arrivals(
            listener=ways.listener,
            delay=ways.length / scene.speed_of_sound,
            gain=np.abs(ways.gain) * np.where(ways.gain.real < 0, -1.0, 1.0),
            departure=ways.departure,
            arrival=ways.arrival,
            order=ways.order,
        )
    )


DIFFRACTION = Effect("diffraction", "around edges (UTD)", needed, apply)
