"""Energy that no listed path carries, found by tracing rays.

Used for rooms that are not boxes, and for boxes when rays are asked for.
"""

from collections import OrderedDict
from dataclasses import dataclass, replace
from threading import Lock
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rir import Poses
from rir.arrays import FloatArray
from rooms.places import random_places
from rooms.scene import Scene
from rooms.sound import Company, Sound

if TYPE_CHECKING:
    from rooms.mesh import MeshGeometry
    from rooms.rays import EnergyHistogram

__all__ = [
    "DEFAULT_RAYS",
    "POOL_RAYS",
    "STEP",
    "Pool",
    "continued",
    "pool_of",
    "traced_energy",
    "with_tail",
]

DEFAULT_RAYS = 20_000  # half of them know C50 to 0.01 dB in a room (docs/simulating)
_CLASSES = 32
"""Of the cosine of incidence: half as many move decays of stiff walls by 0.3 %."""

STEP = 0.004  # s: far below the 50 ms of C50, with enough rays in each


_POOL, POOL_RAYS = (3, 6), 4000
"""Places of a pool, and rays a pair: 18 pairs stray as any do, and their mean is known
four times better than one."""

_JOIN = 8
"""Steps over which levels are compared where a tail joins: 32 ms."""

_KEPT = 8  # pools: as many as scenes and plans are at work at a time


def traced_energy(scene: Scene, sound: Sound) -> tuple[NDArray[np.float64], float]:
    """Return the energy per second of each listener, (listeners, steps, bands).

    Where the plan says that late sound is mixed, each pair is traced up to then, and
    all have the mean of a few places beyond.
    """
    duration = sound.budget.duration
    until = min(sound.budget.work.traced_until, duration)
    histogram = _own(scene, sound, until)
    if until < duration:
        histogram = continued(histogram, pool_of(scene, sound).histogram)
    sound.traced = histogram
    energy = np.moveaxis(histogram.energy[0], 1, 2) / histogram.time_step
    return energy, histogram.time_step


def _own(scene: Scene, sound: Sound, until: float) -> "EnergyHistogram":
    """Return what is traced between an emitter and its listeners.

    Rays depend on the place that sends them, so those of listeners are traced once
    for all emitters of a company, and give each what it would get alone.
    """
    rays = sound.budget.rays or sound.budget.work.rays or DEFAULT_RAYS
    company = sound.company or Company(sound.emitter.position[None])
    if company.traced is None:
        ends = company.emitters, sound.listeners.positions
        company.traced = _traced(scene, sound, ends, rays, until, sound.budget.seed)
    row = slice(sound.number, sound.number + 1)
    found = company.traced
    return replace(
        found,
        energy=found.energy[row],
        error=found.error[row],
        total_error=found.total_error[row],
    )


def _mesh(scene: Scene, sound: Sound) -> "MeshGeometry":
    return scene.geometry.mesh if sound.parts is None else sound.parts.mesh


def _traced(
    scene: Scene,
    sound: Sound,
    ends: tuple[FloatArray, FloatArray],
    rays: int,
    duration: float,
    seed: int,
) -> "EnergyHistogram":
    from rooms.rays import trace_energy

    absorption, scattering = _shares(scene, sound)
    return trace_energy(
        _mesh(scene, sound),
        absorption,
        scattering,
        *ends,
        rays=rays,
        duration=duration,
        time_step=STEP,
        speed_of_sound=scene.speed_of_sound,
        seed=seed,
        skip_specular_up_to=sound.listed_order,
    )


@dataclass(frozen=True, eq=False)
class Pool:
    """What is traced between a few places of a room."""

    emitters: Poses
    """Where rays leave."""
    listeners: Poses
    """Where they are heard."""
    histogram: "EnergyHistogram"
    """Energy between all pairs."""


_POOLS: "OrderedDict[tuple[Any, ...], Pool]" = OrderedDict()

_TRACING = Lock()  # threads wait for a pool rather than trace it again


def pool_of(scene: Scene, sound: Sound) -> Pool:
    """Return the pool of a scene, traced once for all that reflects alike in it.

    Its places and rays depend on the room alone, so that exchanging the ends of a pair
    changes nothing.

    Raises
    ------
    SceneError
        If the room has no free places.
    """
    shares = _shares(scene, sound)
    key = (
        _mesh(scene, sound),
        *(share.tobytes() for share in shares),
        scene.speed_of_sound,
        sound.budget.duration,
        sound.listed_order,
    )
    with _TRACING:
        if key not in _POOLS:
            _POOLS[key] = _new_pool(scene, sound)
            if len(_POOLS) > _KEPT:
                _POOLS.popitem(last=False)
        return _POOLS[key]


def _new_pool(scene: Scene, sound: Sound) -> Pool:
    places = random_places(scene, sum(_POOL), np.random.default_rng(0))
    one, other = places[: _POOL[0]], places[_POOL[0] :]
    ends = one.positions, other.positions
    found = _traced(scene, sound, ends, POOL_RAYS, sound.budget.duration, 0)
    return Pool(one, other, found)


def continued(own: "EnergyHistogram", pool: "EnergyHistogram") -> "EnergyHistogram":
    """Return histograms of pairs that go on as the mean of a pool does."""
    first = own.energy.shape[-1]
    pairs = pool.energy.shape[0] * pool.energy.shape[1]
    shape = (*own.energy.shape[:-1], pool.energy.shape[-1] - first)
    energy = with_tail(own.energy, pool.energy.mean(axis=(0, 1)))[..., first:]
    # places share the rays of their other ends: as many are independent as are places
    error = np.sqrt((pool.error**2).mean(axis=(0, 1)) / pairs**0.5)[:, first:]
    return replace(
        own,
        energy=np.concatenate([own.energy, energy], axis=-1),
        error=np.concatenate([own.error, np.broadcast_to(error, shape)], axis=-1),
    )


def with_tail(own: FloatArray, mean: FloatArray) -> FloatArray:
    """Return energies (..., bands, bins) that go on as a mean (bands, more bins).

    The mean is taken at the level that each pair has just before: what makes a place
    louder or fainter in one moment does so in the next.
    """
    first = own.shape[-1]
    last = slice(max(0, first - _JOIN), first)
    level = mean[:, last].sum(axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        scale = own[..., last].sum(axis=-1) / level
    scale = np.where(level > 0, scale, 1.0)
    return np.concatenate([own, scale[..., None] * mean[:, first:]], axis=-1)


def _shares(scene: Scene, sound: Sound) -> tuple[FloatArray, FloatArray]:
    """Return absorption and scattering, (surfaces or parts, [classes,] bands)."""
    if not sound.local:
        spread = sound.scattering
        none = np.zeros_like(scene.absorption)
        return scene.absorption, none if spread is None else spread
    met = sound.by_class(_CLASSES, sound.parts)
    return np.clip(1.0 - met.pressure**2, 0.0, 1.0), met.scattered
