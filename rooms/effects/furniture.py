"""Furniture: what stands in a box-shaped room reflects, shades, bends and transmits.

A room whose furniture matters is simulated as the mesh of its walls and pieces, by the
effects that meshes have; see `rooms.furniture`.
"""

import numpy as np

from rir.arrays import FloatArray
from rooms.effects.effect import Effect, Need, Tolerance, judged
from rooms.furniture import Furniture
from rooms.predict import differences, predict_parameters
from rooms.scene import Scene
from rooms.sound import Budget, Sound

__all__ = ["FURNITURE"]

_WAYS = 1000
"""Random straight ways that tell how much a piece hides: to 1.5 % of them."""

_PER_DB = {"clarity_db": 1.2, "early_decay_percent": 6.0}
"""What other parameters stray per dB of level (benchmarks/planner_honesty)."""

_MIRRORED = 25.0
"""Percent of T60 per root of what mirrors carry and furniture takes from them, as
scattering does in boxes."""

_COST_S = 0.02
"""For one of several pairs in a kitchen (benchmarks/furnished_kitchen.py) [s]."""


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Need:
    """Judge by how much sound meets furniture, and by what that does to decays."""
    pieces = scene.furniture
    if pieces is None:
        told = "no furniture is stated" if scene.geometry.lattice else "part of a mesh"
        return Need(False, told)
    bare, furnished = (
        predict_parameters(room, budget.duration) for room in (scene, scene.furnished)
    )
    heard = scene.bands < budget.sample_rate / 2
    errors = differences(furnished, bare, heard)
    share = _met(scene)
    # what meets furniture arrives elsewhere in time: as what is scattered
    errors["level_db"] = max(errors["level_db"], 2 * share**0.5)
    kept = _MIRRORED * (share * _mirrored(scene)) ** 0.5
    errors["reverberation_percent"] = max(errors["reverberation_percent"], kept)
    for kind, factor in _PER_DB.items():
        errors[kind] = max(errors[kind], factor * errors["level_db"])
    why = f"{_told(scene, pieces)}: {100 * share:.0f} % of the sound meets furniture"
    return judged(tolerance, errors, why, _COST_S)


def _met(scene: Scene) -> float:
    """Return the share of the energy that meets furniture on its way.

    Ways in a diffuse field meet surfaces of area S in a volume V once in 4 V / S
    (C. W. Kosten, Acustica 10, 245 (1960)); energy is heard after c T / 13.8, in the
    mean.
    """
    room = scene.furnished
    names = room.geometry.surface_names
    pieces = scene.furniture.names if scene.furniture is not None else ()
    own = np.isin(np.array(names), pieces)
    rate = float(room.geometry.areas[own].sum()) / (4 * room.geometry.volume)
    decay = min(float(room.eyring_t60().max()), 10.0)
    heard = room.speed_of_sound * decay / (6 * np.log(10))
    return float(-np.expm1(-rate * heard))


def _mirrored(scene: Scene) -> float:
    """Return the share of the energy 20 dB down that mirrors alone have carried."""
    box = scene.geometry
    decay = min(float(scene.eyring_t60().max()), 10.0) / 3
    met = scene.speed_of_sound * decay * box.areas.sum() / (4 * box.volume)
    mean = box.areas @ scene.scattering / box.areas.sum()
    return float((1 - mean.min()) ** met)


def _told(scene: Scene, pieces: Furniture) -> str:
    """Return what each piece does."""
    hidden = _hidden(scene, pieces)
    told = []
    for k, name in enumerate(pieces.names):
        kept = 100 * (1 - pieces.absorption[k].mean())
        parts = [f"reflects {kept:.0f} %", f"hides {100 * hidden[k]:.0f} %"]
        if np.any(pieces.transmission[k]):
            parts.append(f"lets through {100 * pieces.transmission[k].max():.2g} %")
        if pieces.assumed[k]:
            parts.append("assumed wooden")
        told.append(f"{name} ({', '.join(parts)})")
    return "; ".join(told)


def _hidden(scene: Scene, pieces: Furniture) -> FloatArray:
    """Return the share of straight ways that each piece cuts, shape (pieces,)."""
    rng = np.random.default_rng(0)
    ends = scene.geometry.size * rng.random((2, _WAYS, 3))
    free = ~(pieces.holds(ends[0]) | pieces.holds(ends[1]))
    cut = pieces.cuts(ends[0][free], ends[1][free])
    return cut.sum(axis=0) / max(1, int(free.sum()))


def apply(scene: Scene, sound: Sound) -> None:
    """Do nothing: the scene that follows has the furniture in it."""
    del scene, sound


def stage(scene: Scene) -> Scene:
    """Return the room as a mesh with its furniture."""
    return scene.furnished


FURNITURE = Effect(
    "furniture", "boxes that stand in the room", needed, apply, stage=stage
)
