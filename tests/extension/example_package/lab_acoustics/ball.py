"""An effect: sound that a small hard ball in the room passes on."""

import numpy as np

from rooms.effects import Effect, Need, Tolerance
from rooms.scene import Scene
from rooms.sound import Arrivals, Budget, Sound

PLACE = np.array([1.0, 0.5, 2.2])
"""Middle of the ball, m."""
RADIUS = 0.1
"""Of the ball, m."""


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Need:
    """Judge by the level of the ball against the direct sound, one metre away."""
    del scene, budget
    level = float(20 * np.log10(1 + 0.5 * RADIUS))
    on = level > tolerance.level_db
    return Need(on, f"a ball of {RADIUS:g} m", {"level_db": level}, 1e-6)


def apply(scene: Scene, sound: Sound) -> None:
    """Add the way over the ball: half its radius over both distances."""
    here = PLACE - sound.emitter.position
    there = PLACE - sound.listeners.positions
    first, second = np.linalg.norm(here), np.linalg.norm(there, axis=1)
    gain = 0.5 * RADIUS / (first * second)
    count = len(second)
    sound.arrivals.append(
        Arrivals(
            listener=np.arange(count),
            delay=(first + second) / scene.speed_of_sound,
            gain=np.repeat(gain[:, None], len(scene.bands), axis=1),
            departure=np.repeat(here[None] / first, count, axis=0),
            arrival=there / second[:, None],
            order=np.ones(count, dtype=np.int64),
        )
    )


BALL = Effect("ball", "a small hard ball", needed, apply, after="direct")
