"""When coarser sound may take over: what the mean decay of a room says of its end."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray
from rooms.effects import Tolerance
from rooms.effects.modes import marched_octaves
from rooms.effort import decay_parameters
from rooms.energy_flow import energy_flow
from rooms.predict import equivalent_box
from rooms.scene import Scene
from rooms.sound import Budget

__all__ = ["grid_until", "images_error", "images_until"]

_IMAGES_SHARE = 0.05
"""What part of the tolerance waves in place of images may take. Their error is that of
the mean of a room; where two hard walls keep sound, single places stray further."""

_UNEVEN = 0.6
"""How far the images' energy at single places strays from the mean of the room."""

_GRID_SHARE = 0.2
"""What part of the tolerance rays in place of the wave grid may take."""

_TAKEN_OVER = 2.0
"""Factor of energy by which rays may carry on too much or too little: decays that
differ by a tenth do so after 30 dB."""

_STEPS = 100  # 200 move no end that is chosen

_CANDIDATES = np.array([0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9])
"""Ends of single images as shares of a response."""


def images_until(scene: Scene, budget: Budget, tolerance: Tolerance) -> float:
    """Return when waves may take over from the images of a box [s]."""
    ends = (_CANDIDATES * budget.duration).tolist()
    for end, errors in zip(ends, _images_errors(scene, budget, ends), strict=False):
        if tolerance.excess(errors, _IMAGES_SHARE) <= 1:
            return end
    return np.inf


def images_error(scene: Scene, budget: Budget, until: float) -> dict[str, float]:
    """Return the error of waves in place of the images of a box after a time [s].

    Waves carry the same energy on the mean. What both bring to a single place and
    octave strays from it, see `_strays`.
    """
    return next(_images_errors(scene, budget, [until]))


def _images_errors(
    scene: Scene, budget: Budget, ends: Sequence[float]
) -> Iterator[dict[str, float]]:
    mean = _mean_decay(scene, budget)
    width = scene.bands / np.sqrt(2)
    heard = scene.bands < budget.sample_rate / 2
    heard[0] = True
    for end in ends:
        late = mean.times > end
        parts = mean.images[late], mean.scattered[late]
        yield _bent(mean, end, 1 + _strays(*parts, width * mean.step), heard)


def grid_until(scene: Scene, budget: Budget, tolerance: Tolerance) -> float:
    """Return when rays may take over from the wave grid [s].

    Each sees the decay of the low octaves in its own way, and may be wrong about what
    is left by a factor. Where decay times are asked for, it is marched to the end.
    """
    if np.isfinite(tolerance.reverberation_percent):
        return np.inf
    mean = _mean_decay(equivalent_box(scene), budget)
    factor, octaves = (
        np.full(len(scene.bands), _TAKEN_OVER),
        marched_octaves(scene, budget),
    )
    for end in (_CANDIDATES * budget.duration).tolist():
        errors = _bent(mean, end, factor, octaves)
        if tolerance.excess(errors, _GRID_SHARE) <= 1:
            return end
    return np.inf


@dataclass(frozen=True, eq=False)
class _Decay:
    """Mean energies of a box in steps of time, each (steps, bands)."""

    times: FloatArray
    step: float
    arrival: float
    images: FloatArray
    scattered: FloatArray
    direct: FloatArray


def _mean_decay(scene: Scene, budget: Budget) -> _Decay:
    step = budget.duration / _STEPS
    times = step * np.arange(0.5, _STEPS, dtype=np.float64)
    flow = energy_flow(scene, times, scattering=scene.scattering)
    fade = np.exp(-scene.air_loss * scene.speed_of_sound * times[:, None]) * step
    distance = 0.4 * float(np.cbrt(scene.geometry.volume))
    arrival = distance / scene.speed_of_sound
    fade = np.where(times[:, None] < arrival, 0.0, fade)
    direct = np.zeros_like(fade)
    direct[min(int(arrival / step), _STEPS - 1)] = 1 / distance**2
    parts = fade * flow.images, fade * flow.scattered, direct
    return _Decay(times, step, arrival, *parts)


def _bent(
    mean: _Decay, end: float, factor: FloatArray, heard: NDArray[np.bool_]
) -> dict[str, float]:
    """Return what a factor too much or too little after a time changes, per octave."""
    late = mean.times[:, None] > end
    whole = mean.images + mean.scattered + mean.direct
    found = []
    for part in (factor, 1 / factor):
        bent = np.where(late, part * whole, whole)[:, heard]
        found.append(decay_parameters(bent.T[None], mean.step, mean.arrival)[:, 0])
    return _differences(*found)


def _strays(
    images: FloatArray, scattered: FloatArray, samples: FloatArray
) -> FloatArray:
    """Return the standard error of energies, (steps, bands), that waves replace.

    Energy in a band strays by one over the root of bandwidth times duration: that of
    the images, that of the waves for them, and their product with what is scattered
    anyway. Mirrors that keep sound between two walls bring more or less to a place
    at any frequency.
    """
    whole = images + scattered
    total = np.maximum(whole.sum(axis=0), 1e-300)
    count = samples * total**2 / np.maximum((whole**2).sum(axis=0), 1e-300)
    noise = (4 * scattered + 2 * images) * images
    noise = np.sqrt(noise.sum(axis=0) / np.maximum((whole**2).sum(axis=0), 1e-300))
    kept = images.sum(axis=0) / total
    return np.sqrt(noise**2 / np.maximum(count, 1) + (_UNEVEN * kept) ** 2)


def _differences(more: FloatArray, less: FloatArray) -> dict[str, float]:
    """Return half the difference of parameters, (4, bands), the worst octave."""
    with np.errstate(invalid="ignore", divide="ignore"):
        change = np.abs(more - less) / 2
        change[2:] = 200 * change[2:] / (more[2:] + less[2:])
    # a decay that cannot be told with one is told with the other: never equal
    change[np.isnan(more) != np.isnan(less)] = np.inf
    kinds = ("level_db", "clarity_db", "reverberation_percent", "early_decay_percent")
    known = np.where(np.isnan(change), 0.0, change)
    return dict(zip(kinds, known.max(axis=1, initial=0.0).tolist(), strict=True))
