"""The measuring chain: loudspeaker, microphone, noise, clock drift."""

import numpy as np

from rir.arrays import FloatArray
from rooms.effects.effect import Effect, Need, Tolerance
from rooms.scene import Scene
from rooms.sound import Budget, Sound

__all__ = ["HARDWARE"]


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Need:
    """Answer yes exactly if the scene states a chain."""
    del budget, tolerance
    if scene.hardware is None:
        return Need(False, "the scene states no measuring chain")
    return Need(True, "the scene states a measuring chain")


def apply(scene: Scene, sound: Sound) -> None:
    """Pass finished responses through the chain; noise depends on seed and places."""
    chain = scene.hardware
    if chain is None:
        return

    def finish(responses: FloatArray) -> FloatArray:
        place = np.ascontiguousarray(sound.emitter.position).view(np.uint64)
        rng = np.random.default_rng([sound.budget.seed, *place.tolist()])
        return chain.heard(responses, sound.budget.sample_rate, rng)

    sound.finishers.append(finish)


HARDWARE = Effect("hardware", "loudspeaker, microphone, noise, drift", needed, apply)
