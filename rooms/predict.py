"""Predict room-acoustic parameters from the mean energy flow, without simulating."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray
from rir.decay import fit_line, remaining_energy
from rir.errors import SceneError
from rir.physics import decibels
from rooms.energy_flow import energy_flow
from rooms.geometry import Shoebox
from rooms.scene import Scene

__all__ = [
    "ODD_SHAPE",
    "Parameters",
    "differences",
    "predict_parameters",
    "predicted_errors",
    "scattered_share",
]

ODD_SHAPE = 100.0
"""Percent of T60 per root of the scattered share in rooms that are not boxes: what
mirrors keep between hard walls of coupled rooms lasts longest of all."""

_STEPS = 200  # 800 move levels by 0.11 dB, C50 by 0.03 dB and T60 by 0.3 %


@dataclass(frozen=True, eq=False)
class Parameters:
    """Parameters per octave, each of shape (bands,); NaN where undefined."""

    level_db: FloatArray
    reverberation: FloatArray
    clarity_db: FloatArray
    early_decay: FloatArray


def equivalent_box(scene: Scene) -> Scene:
    """Return a scene whose shape is a box: the scene itself, or one of equal volume.

    Another shape becomes its bounding box scaled to its volume. Each of the six walls
    gets the mean of the surfaces that face its way, so that hard walls opposite each
    other keep sound as long as in the room itself. What is open absorbs on all alike.
    """
    geometry = scene.geometry
    if geometry.lattice:
        return scene
    if not geometry.volume > 0:
        raise SceneError("the mesh holds no air: sound in it meets no surface again")
    size = np.maximum(np.asarray(geometry.size, dtype=float), 1e-3)
    size = size * (geometry.volume / np.prod(size)) ** (1 / 3)
    facing = geometry.facing()
    shares = {
        name: facing @ getattr(scene, name)
        for name in ("absorption", "scattering", "transmission")
    }
    kept = (1 - geometry.open_share) * (1 - shares["absorption"])
    shares["absorption"] = 1 - kept
    return replace(scene, geometry=Shoebox(size), walls={}, seats=(), **shares)


def scattered_share(scene: Scene, duration: float) -> float:
    """Return the share of scattered energy 20 dB down the decay, worst octave.

    Parameters
    ----------
    scene : Scene
        Any scene; shapes other than boxes are taken as `equivalent_box`.
    duration : float
        Length of the response [s], which the decay does not outlast.
    """
    box = equivalent_box(scene)
    longest = min(float(scene.eyring_t60().max()) / 3, duration)
    flow = energy_flow(box, np.array([longest]), scattering=box.scattering)
    total = flow.images + flow.scattered
    return float(np.max(flow.scattered / np.maximum(total, 1e-300)))


@lru_cache(maxsize=64)
def predict_parameters(
    scene: Scene,
    duration: float,
    *,
    until: float = np.inf,
) -> Parameters:
    """Predict the parameters of a typical pair of places from the mean flow of energy.

    Parameters
    ----------
    scene : Scene
        Any scene; shapes other than boxes are taken as `equivalent_box`.
    duration : float
        Length of the response [s].
    until : float
        When the response ends, if sooner [s].
    """
    box = equivalent_box(scene)
    times = (np.arange(_STEPS) + 0.5) * duration / _STEPS
    flow = energy_flow(box, times, scattering=box.scattering)
    energy = (flow.images + flow.scattered) * duration / _STEPS
    distance = max(0.4 * float(np.cbrt(box.geometry.volume)), 1e-3)
    energy[times < distance / box.speed_of_sound] = 0.0
    energy[times > until] = 0.0
    direct = np.full(energy.shape[1], 1 / distance**2)
    energy *= np.exp(-box.air_loss * box.speed_of_sound * times[:, None])
    direct *= np.exp(-box.air_loss * distance)
    return _parameters(energy, direct, times, distance / box.speed_of_sound)


def _parameters(
    energy: FloatArray, direct: FloatArray, times: FloatArray, arrival: float
) -> Parameters:
    # rounding leaves less than nothing of sums that end in silence
    left = np.maximum(remaining_energy(energy, axis=0), 1e-300)
    total = left[0] + direct
    early = direct + energy[times < arrival + 0.05].sum(axis=0)
    curve = np.maximum(decibels(left / total), -200.0)
    with np.errstate(divide="ignore"):
        clarity = decibels(early / np.maximum(total - early, 1e-30 * total))
    decay = np.maximum(decibels(left / np.maximum(left[0], 1e-300)), -200.0)
    return Parameters(
        level_db=decibels(total),
        reverberation=_times(times, decay, -5, -35),
        clarity_db=np.minimum(clarity, 60.0),
        early_decay=_times(times, curve, 0.1, -10),
    )


def _times(
    times: FloatArray, curves: FloatArray, high: float, low: float
) -> FloatArray:
    """Return 60 dB over the slope of each curve between two levels [s]."""
    return np.array([-60 / fit_line(times, curve, high, low)[0] for curve in curves.T])


def predicted_errors(
    scene: Scene,
    duration: float,
    sample_rate: int,
    without: Callable[[Scene], Scene],
) -> dict[str, float]:
    """Predict what leaving something off changes, the worst octave of each kind.

    Parameters
    ----------
    scene : Scene
        The scene.
    duration : float
        Length of the response [s].
    sample_rate : int
        Octaves above half of it do not count [Hz].
    without : callable
        (scene) -> the scene without it, as `rooms.effects.Effect.without`.
    """
    full = predict_parameters(scene, duration)
    less = predict_parameters(_changed(scene, without), duration)
    return differences(full, less, scene.bands < sample_rate / 2)


@lru_cache(maxsize=64)
def _changed(scene: Scene, change: Callable[[Scene], Scene]) -> Scene:
    # the same scene each time, so that its prediction is found again
    return change(scene)


def differences(
    full: Parameters, less: Parameters, heard: NDArray[np.bool_]
) -> dict[str, float]:
    """Return how far parameters lie apart, the worst of the octaves that are heard."""
    heard = heard.copy()
    heard[0] = True

    def worst(values: FloatArray) -> float:
        kept = np.abs(values[heard])
        return float(np.max(kept[np.isfinite(kept)], initial=0.0))

    with np.errstate(invalid="ignore", divide="ignore"):
        return {
            "level_db": worst(less.level_db - full.level_db),
            "reverberation_percent": worst(
                100 * (less.reverberation / full.reverberation - 1)
            ),
            "clarity_db": worst(less.clarity_db - full.clarity_db),
            "early_decay_percent": worst(
                100 * (less.early_decay / full.early_decay - 1)
            ),
        }
