"""Finite panels: faces too small for a wavelength mirror less, and scatter the rest."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from rir.arrays import FloatArray
from rir.physics import decibels
from rooms.effects.effect import Effect, Need, Tolerance, judged
from rooms.predict import (
    ODD_SHAPE,
    differences,
    predict_parameters,
    scattered_share,
)
from rooms.scene import Scene
from rooms.sound import Budget, Sound, SurfaceParts

__all__ = ["PANELS"]


_EDT_PER_DB = 6.0
"""What EDT strays per dB of level, in percent (benchmarks/planner_honesty)."""


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Need:
    """Judge by what the faces' sizes take from their mirrors on average."""
    loss = mirror_loss(scene)
    if not np.any(loss):
        return Need(False, "no face has a free edge")
    errors = differences(
        predict_parameters(_rougher(scene), budget.duration),
        predict_parameters(scene, budget.duration),
        scene.bands < budget.sample_rate / 2,
    )
    areas = scene.geometry.areas
    kept = (1 - scene.absorption) * (1 - scene.scattering)
    share = areas @ (kept * loss) / np.maximum(areas @ kept, 1e-300)
    heard = scene.bands < budget.sample_rate / 2
    most = float(share[heard].max(initial=0.0))
    # a mirror that fails may be the only one that two places have
    errors["level_db"] = max(errors["level_db"], -float(decibels(1 - min(most, 0.99))))
    errors["clarity_db"] = max(errors["clarity_db"], errors["level_db"])
    errors["early_decay_percent"] = max(
        errors["early_decay_percent"], _EDT_PER_DB * errors["level_db"]
    )
    errors["reverberation_percent"] = max(
        errors["reverberation_percent"], _stray(scene, budget)
    )
    why = f"faces are too small to mirror {100 * most:.2g} % of the sound they return"
    return judged(tolerance, errors, why, 2e-3)


def _stray(scene: Scene, budget: Budget) -> float:
    """Return how far T60 strays for what panels scatter of what mirrors carry [%]."""
    rough, smooth = (
        scattered_share(room, budget.duration) for room in (_rougher(scene), scene)
    )
    return ODD_SHAPE * max(rough**0.5 - smooth**0.5, 0.0)


@lru_cache(maxsize=32)
def mirror_loss(scene: Scene) -> FloatArray:
    """Return the share that surfaces do not mirror for their size, (surfaces, bands).

    A mean over directions, places and panels, one mean free path from both ends.
    """
    loss = np.zeros_like(scene.absorption)
    if scene.geometry.lattice:
        return loss
    from rooms.panels import finite_panels

    change = finite_panels(scene.geometry.mesh, scene.bands, scene.speed_of_sound)
    if change is None:
        return loss
    free = 4 * scene.geometry.volume / scene.geometry.areas.sum()
    return np.maximum(1 - change.mean(free), 0.0)


@lru_cache(maxsize=32)
def _rougher(scene: Scene) -> Scene:
    """Return the scene whose surfaces scatter what their panels do not mirror."""
    spread = scene.scattering + (1 - scene.scattering) * mirror_loss(scene)
    return replace(scene, scattering=spread)


def apply(scene: Scene, sound: Sound) -> None:
    """Let what faces do not mirror for their size be scattered."""
    if scene.geometry.lattice:
        return
    from rooms.panels import finite_panels, parts_of

    change = finite_panels(scene.geometry.mesh, scene.bands, scene.speed_of_sound)
    if change is not None:
        sound.bounce_changes.append(change)
        sound.parts = SurfaceParts(*parts_of(scene.geometry.mesh))
        sound.fading_mirrors = True


PANELS = Effect(
    "panels", "faces of limited size scatter", needed, apply, within=_rougher
)
