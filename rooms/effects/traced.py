"""Energy that no listed path carries, found by tracing rays.

Used for rooms that are not boxes, and for boxes when rays are asked for.
"""

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray
from rooms.scene import Scene
from rooms.sound import Sound

__all__ = ["DEFAULT_RAYS", "traced_energy"]

DEFAULT_RAYS = 20_000  # half of them know C50 to 0.01 dB in a room (docs/simulating)
_CLASSES = 32
"""Of the cosine of incidence: half as many move decays of stiff walls by 0.3 %."""

_STEP = 0.004  # s: far below the 50 ms of C50, with enough rays in each


def traced_energy(scene: Scene, sound: Sound) -> tuple[NDArray[np.float64], float]:
    """Return the energy per second of each listener, (listeners, steps, bands)."""
    from rooms.rays import trace_energy

    budget = sound.budget
    absorption, scattering = _shares(scene, sound)
    histogram = trace_energy(
        scene.geometry.mesh if sound.parts is None else sound.parts.mesh,
        absorption,
        scattering,
        sound.emitter.position[None],
        sound.listeners.positions,
        rays=budget.rays or budget.work.rays or DEFAULT_RAYS,
        duration=budget.duration,
        time_step=_STEP,
        speed_of_sound=scene.speed_of_sound,
        seed=budget.seed,
        skip_specular_up_to=sound.listed_order,
    )
    sound.traced = histogram
    energy = np.moveaxis(histogram.energy[0], 1, 2) / histogram.time_step
    return energy, histogram.time_step


def _shares(scene: Scene, sound: Sound) -> tuple[FloatArray, FloatArray]:
    """Return absorption and scattering, (surfaces or parts, [classes,] bands)."""
    if not sound.local:
        spread = sound.scattering
        none = np.zeros_like(scene.absorption)
        return scene.absorption, none if spread is None else spread
    met = sound.by_class(_CLASSES, sound.parts)
    return np.clip(1.0 - met.pressure**2, 0.0, 1.0), met.scattered
