"""The measuring chain: loudspeaker, microphone, noise, clock drift."""

import numpy as np
from numpy.typing import NDArray

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
        ends = _bits(sound.emitter.position), _bits(sound.listeners.positions)
        noise = (
            np.random.default_rng([sound.budget.seed, *ends[0].tolist(), *place])
            for place in ends[1].tolist()
        )
        return chain.heard(responses, sound.budget.sample_rate, noise)

    sound.finishers.append(finish)


def _bits(places: FloatArray) -> NDArray[np.uint64]:
    return np.ascontiguousarray(places).view(np.uint64)


HARDWARE = Effect("hardware", "loudspeaker, microphone, noise, drift", needed, apply)
