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
from rooms.transport import (
    FINE,
    find_places,
    image_energy,
    pair_energy,
    transport_of,
)

__all__ = [
    "ANY_ORDER",
    "MESH_ORDER",
    "fading_before",
    "flow_energy",
    "flow_of",
    "handover_time",
    "missing_energy",
    "waves_share",
]

STEP = 0.001
"""Time resolution of the energy flow [s]."""

MESH_ORDER = 3
"""Reflection order listed in rooms that are not boxes, unless another is asked for."""

_EARLY = 0.06
"""End of what is early [s]: 50 ms from a direct sound that comes after some 10."""

_NEGLIGIBLE = 1e-4
"""Share of the energy below which images need no list of their own (-40 dB)."""


_UNHEARD = 1e-2
"""Share of the energy (-20 dB) whose spread over places, a half or so, moves a level by
0.02 dB."""

ANY_ORDER = 1 << 30  # no response is as long, and sums of orders still fit 32 bits

_FADING = 0.03
"""Images fade over two periods of the lowest octave's lower edge [s]: all of one sign,
they sum to a slow pressure, whose sharp end would click in the lowest octaves."""


@lru_cache(maxsize=8)
def _flow(
    scene: Scene, scattered: bool, max_order: int | None, duration: float
) -> EnergyFlow:
    times = np.arange(0.5 * STEP, duration + 2 * STEP, STEP)
    spread = scene.scattering if scattered else None
    return energy_flow(scene, times, scattering=spread, max_order=max_order)


def flow_of(scene: Scene, sound: Sound) -> EnergyFlow:
    """Return the mean energy flow of a shoebox scene, computed once per scene."""
    budget = sound.budget
    scattered = sound.scattering is not None
    return _flow(scene, scattered, budget.max_order, budget.duration)


def handover_time(scene: Scene, sound: Sound) -> float:
    """Return the time [s] after which no image is listed.

    Where surfaces scatter, waves come in anyway, one a sample. They take over from the
    images once these are as dense, or carry less than -40 dB of the energy, or sooner
    if the plan says that the tolerance bears it: no response tells later ones apart,
    and rough walls do not keep the phases that so many sums of them would need.
    """
    until = min(sound.budget.work.images_until, sound.budget.duration)
    if not scene.geometry.lattice or sound.scattering is None:
        return until
    flow = flow_of(scene, sound)
    mirrored = flow.images
    share = mirrored / np.maximum(mirrored + flow.beyond + flow.scattered, 1e-300)
    strong: NDArray[np.bool_] = np.any(share > _NEGLIGIBLE, axis=1)
    last = int(np.max(np.nonzero(strong)[0], initial=0))
    return min(float(flow.times[last] + STEP), _dense_after(scene, sound), until)


def _dense_after(scene: Scene, sound: Sound) -> float:
    """Return when one image a sample arrives, and the fade that follows, is over [s].

    By then 4 pi c³ t² / V images arrive per second.
    """
    volume, c = scene.geometry.volume, scene.speed_of_sound
    dense = np.sqrt(sound.budget.sample_rate * volume / (4 * np.pi * c**3))
    return float(dense) + _FADING


def fading_before(scene: Scene, sound: Sound) -> float:
    """Return how long before the handover images fade out and waves in [s]."""
    until = handover_time(scene, sound)
    return min(_FADING, until / 2) if until < sound.budget.duration else 0.0


def waves_share(scene: Scene, sound: Sound, times: FloatArray) -> FloatArray:
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
    # clarity is lost where the late part is: what is early hardly matters to it
    after = times > _EARLY
    late = 1 + left_out[after].sum(axis=0) / np.maximum(
        flow.images[after].sum(axis=0), 1e-12
    )
    return {
        "level_db": level,
        "clarity_db": float(min(np.max(decibels(late)), 60.0)),
        "reverberation_percent": 100 * share,
        "early_decay_percent": 100 * share,
    }


def flow_energy(scene: Scene, sound: Sound) -> tuple[NDArray[np.float64], float]:
    """Return the energy per second that the images of a box leave out, and its step.

    Returns
    -------
    energy : ndarray, shape (1 or listeners, steps, bands)
        The same for all listeners if nothing is scattered.
    step : float
        Time step [s].
    """
    flow = flow_of(scene, sound)
    if not len(sound.listeners.positions):
        return np.zeros((0, *flow.images.shape)), STEP
    energy = _mirrored_energy(scene, sound, flow)
    spread = sound.scattering
    if spread is None or not np.any(spread):
        return energy, STEP
    return energy + _scattered_energy(scene, sound, spread, len(flow.times)), STEP


def _mirrored_energy(scene: Scene, sound: Sound, flow: EnergyFlow) -> FloatArray:
    """Return what images bring that are not listed, (1 or listeners, steps, bands)."""
    order = sound.budget.max_order
    mean = flow.beyond
    share = np.zeros(len(flow.times))
    if sound.lattice is not None:
        share = waves_share(scene, sound, flow.times)
        mean = mean + share[:, None] * flow.images
    if not np.any(mean):
        return mean[None]
    steps = _uneven_steps(flow)
    span = scene.speed_of_sound, STEP, steps
    listed = ANY_ORDER if order is None else order, share[:steps]
    kept, size = sound.reflection**2, np.asarray(scene.geometry.size)
    ends = sound.emitter.position, sound.listeners.positions
    energy, known = image_energy(size, kept, ends, span, listed)
    whole = np.repeat(mean[None], len(energy), axis=0)
    whole[:, :known] = energy[:, :known]
    return whole


def _uneven_steps(flow: EnergyFlow) -> int:
    """Return for how many steps mirrors are strong enough to tell places apart."""
    mirrored = flow.images + flow.beyond
    total = np.maximum(mirrored + flow.scattered, 1e-300)
    strong = np.any(mirrored > _UNHEARD * total, axis=1)
    return int(np.max(np.nonzero(strong)[0], initial=0)) + 1


def _scattered_energy(
    scene: Scene, sound: Sound, spread: FloatArray, steps: int
) -> FloatArray:
    """Return what is scattered on the way, shape (listeners, steps, bands)."""
    box = transport_of(
        np.asarray(scene.geometry.size), sound.absorption, spread,
        scene.speed_of_sound, sound.budget.duration, FINE,
    )  # fmt: skip
    (emitter,) = find_places(box, sound.emitter.position[None])
    listeners = find_places(box, sound.listeners.positions)
    energies = [pair_energy(box, emitter, place, STEP, steps) for place in listeners]
    return np.stack(energies)
