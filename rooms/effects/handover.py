"""When image sources end and the late tail carries all that is left.

The two effects must agree on it, so that no reflection is missed or counted
twice; see `rooms.effects.specular` and `rooms.effects.late`.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray
from rir.physics import decibels
from rooms.energy_flow import EnergyFlow, energy_flow
from rooms.predict import equivalent_box
from rooms.scene import Scene
from rooms.sound import Budget, Sound

__all__ = [
    "MESH_ORDER",
    "fading_before",
    "flow_energy",
    "flow_of",
    "handover_time",
    "missing_energy",
]

STEP = 0.001
"""Time resolution of the energy flow [s]."""

MESH_ORDER = 3
"""Reflection order listed in rooms that are not boxes, unless another is asked for."""

_NEGLIGIBLE = 1e-4
"""Share of the energy below which images need no list of their own (-40 dB)."""


_FADING = 0.03
"""Images fade over two periods of the lowest octave's lower edge [s]: all of one sign,
they sum to a slow pressure, whose sharp end would click in the lowest octaves."""


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
    """Return the time [s] after which no image is listed.

    It is when images carry less than -40 dB of the energy, or sooner if the plan says
    that the tolerance bears it.
    """
    until = min(sound.budget.work.images_until, sound.budget.duration)
    if not scene.geometry.lattice or sound.scattering is None:
        return until
    flow = flow_of(scene, sound)
    mirrored = flow.images
    share = mirrored / np.maximum(mirrored + flow.beyond + flow.scattered, 1e-300)
    strong: NDArray[np.bool_] = np.any(share > _NEGLIGIBLE, axis=1)
    last = int(np.max(np.nonzero(strong)[0], initial=0))
    return min(float(flow.times[last] + STEP), until)


def fading_before(scene: Scene, sound: Sound) -> float:
    """Return how long before the handover images fade out and waves in [s]."""
    until = handover_time(scene, sound)
    return min(_FADING, until / 2) if until < sound.budget.duration else 0.0


def _waves_share(scene: Scene, sound: Sound, times: FloatArray) -> FloatArray:
    """Return the share of the images' energy that waves carry at some times."""
    until, fading = handover_time(scene, sound), fading_before(scene, sound)
    left = np.clip((until - times) / max(fading, 1e-9), 0, 1)
    return np.where(times >= until, 1.0, np.cos(np.pi / 2 * left) ** 2)


def missing_energy(scene: Scene, budget: Budget) -> dict[str, float]:
    """Predict what the energy in no listed path contributes; empty if there is none."""
    box = equivalent_box(scene)
    order = budget.max_order
    if not scene.geometry.lattice and order is None:
        order = MESH_ORDER
    times = (np.arange(100) + 0.5) * budget.duration / 100
    flow = energy_flow(box, times, scattering=box.scattering, max_order=order)
    left_out = flow.scattered + flow.beyond
    if not np.any(left_out):
        return {}
    listed = flow.images.sum(axis=0) * budget.duration / 100
    extra = left_out.sum(axis=0) * budget.duration / 100
    level = float(np.max(decibels(1 + extra / np.maximum(listed, 1e-12))))
    share = float(np.max(extra / (listed + extra)))
    return {"level_db": level, "reverberation_percent": 100 * share}


def flow_energy(scene: Scene, sound: Sound) -> tuple[NDArray[np.float64], float]:
    """Return the energy per second that the images of a box leave out, and its step.

    Returns
    -------
    energy : ndarray, shape (1, steps, bands)
        The same for all listeners.
    step : float
        Time step [s].
    """
    flow = flow_of(scene, sound)
    energy = flow.scattered + flow.beyond
    if sound.lattice is not None:
        share = _waves_share(scene, sound, flow.times)
        energy = energy + share[:, None] * flow.images
    return energy[None], STEP
