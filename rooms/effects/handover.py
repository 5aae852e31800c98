"""When image sources end and the late tail carries all that is left.

The two effects must agree on it, so that no reflection is missed or counted
twice; see `rooms.effects.specular` and `rooms.effects.late`.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rooms.energy_flow import EnergyFlow, energy_flow
from rooms.geometry import Shoebox
from rooms.scene import Scene
from rooms.sound import Sound

__all__ = ["STEP", "flow_of", "handover_time"]

STEP = 0.001
"""Time resolution of the energy flow [s]."""

_NEGLIGIBLE = 1e-4
"""Share of the energy below which images need no list of their own (-40 dB)."""


@lru_cache(maxsize=8)
def _flow(
    scene: Scene, scattered: bool, max_order: int | None, duration: float
) -> EnergyFlow:
    times = np.arange(0.0, duration + 2 * STEP, STEP)
    spread = scene.scattering if scattered else None
    return energy_flow(scene, times, scattering=spread, max_order=max_order)


def flow_of(scene: Scene, sound: Sound) -> EnergyFlow:
    """Return the mean energy flow of a shoebox scene, computed once per scene."""
    budget = sound.budget
    scattered = sound.scattering is not None
    return _flow(scene, scattered, budget.max_order, budget.duration)


def handover_time(scene: Scene, sound: Sound) -> float:
    """Return the time [s] after which images carry less than -40 dB of the energy."""
    if not isinstance(scene.geometry, Shoebox) or sound.scattering is None:
        return sound.budget.duration
    flow = flow_of(scene, sound)
    mirrored = flow.images
    share = mirrored / np.maximum(mirrored + flow.beyond + flow.scattered, 1e-300)
    strong: NDArray[np.bool_] = np.any(share > _NEGLIGIBLE, axis=1)
    last = int(np.max(np.nonzero(strong)[0], initial=0))
    return min(float(flow.times[last] + STEP), sound.budget.duration)
