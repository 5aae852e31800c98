"""Diffraction: sound bent around the edges of non-convex rooms."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from rir.arrays import FloatArray
from rir.errors import SceneError
from rir.physics import decibels
from rooms.effects.effect import Effect, Need, Tolerance, judged
from rooms.places import random_places
from rooms.scene import Scene
from rooms.sound import Arrivals, Budget, Sound

__all__ = ["DIFFRACTION", "Share", "bent_share"]


_BENT_DB = -14.0
"""Sound bent around one edge against free sound, where nothing can be probed [dB]."""

_PROBES = 9  # two emitters and seven listeners: 14 pairs (docs/decisions/0061)
_PER_DB = {
    "level_db": 1.0,
    "clarity_db": 1.5,
    "reverberation_percent": 4.0,
    "early_decay_percent": 14.0,
}
"""What other parameters stray per dB of level (docs/decisions/0061)."""


@dataclass(frozen=True)
class Share:
    """How much louder a room may be by sound bent around edges [dB]."""

    listed: float
    """By the ways that are listed, straight or mirrored once."""
    early: float
    """By the same, in the first 50 ms."""
    left_out: float
    """By those mirrored twice, which are not."""


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Need:
    """Answer no exactly if no edge opens more than 180°; else judge by a few pairs."""
    del budget
    edges = _edges(scene)
    if not edges:
        return Need(False, "no edge opens more than 180°")
    share = bent_share(scene)
    errors = {kind: factor * share.listed for kind, factor in _PER_DB.items()}
    errors["clarity_db"] = max(errors["clarity_db"], share.early)
    why = (
        f"{edges} edges bend sound (those mirrored twice as well would add"
        f" {share.left_out:.2g} dB and are left out)"
    )
    return judged(tolerance, errors, why, 5e-3)


@lru_cache(maxsize=32)
def bent_share(scene: Scene) -> Share:
    """Return how much louder a few random pairs are by bent sound, at most."""
    from rooms.diffraction import diffracted_paths

    try:
        rng = np.random.default_rng(0)
        places = random_places(scene, _PROBES, rng).positions
    except SceneError:
        level = float(decibels(1 + 10 ** (_BENT_DB / 10)))
        return Share(level, level, level * float(1 - scene.mean_absorption.min()))
    shares = []
    area = scene.geometry.areas.sum() * scene.mean_absorption
    field = 16 * np.pi * (1 - scene.mean_absorption) / np.maximum(area, 1e-9)
    soon = field * -np.expm1(
        -6 * np.log(10) * 0.05 / np.maximum(scene.eyring_t60(), 1e-6)
    )
    for emitter in places[:2]:
        ways = diffracted_paths(
            scene.geometry.mesh,
            emitter,
            places[2:],
            bands=scene.bands,
            speed_of_sound=scene.speed_of_sound,
            reflection=np.sqrt(1 - scene.absorption),
        )
        seen = scene.geometry.mesh.visible(emitter, places[2:])
        straight = (seen / np.sum((places[2:] - emitter) ** 2, axis=1))[:, None]
        bent = np.zeros((2, len(seen), len(scene.bands)))
        np.add.at(bent, (ways.mirrors, ways.listener), np.abs(ways.gain) ** 2)
        # each further mirror finds about as many ways and takes its share
        more = bent[1] * (1 - scene.mean_absorption)
        # near the boundary of a shadow bent sound comes with the straight one and
        # halves or doubles it
        added = bent.sum(axis=0) + 2 * np.sqrt(bent.sum(axis=0) * straight)
        shares.append(
            [
                _louder(added, straight + field),
                _louder(added, straight + soon),
                _louder(more, straight + field),
            ]
        )
    return Share(*map(float, np.max(shares, axis=0)))


def _louder(part: FloatArray, rest: FloatArray) -> float:
    """Return the most that a part adds to the rest [dB]."""
    return float(decibels(1 + part / np.maximum(rest, 1e-9)).max())


def _edges(scene: Scene) -> int:
    """Return how many edges of a room bend sound."""
    if scene.geometry.convex:
        return 0
    from rooms.diffraction import edges_of

    return len(edges_of(scene.geometry.mesh))


def apply(scene: Scene, sound: Sound) -> None:
    """Add the ways around one and two edges, mirrored ones included.

    The gain of a way is complex: within 45° of real, as sqrt(i w) is. It enters by
    its magnitude and the sign of its real part, which is exact at the boundaries
    of shadows and keeps levels elsewhere.
    """
    if scene.geometry.convex:
        return
    from rooms.diffraction import diffracted_paths

    ways = diffracted_paths(
        scene.geometry.mesh,
        sound.emitter.position,
        sound.listeners.positions,
        bands=scene.bands,
        speed_of_sound=scene.speed_of_sound,
        reflection=sound.reflection,
        fading_mirrors=sound.fading_mirrors,
    )
    sound.arrivals.append(
        Arrivals(
            listener=ways.listener,
            delay=ways.length / scene.speed_of_sound,
            gain=np.abs(ways.gain) * np.where(ways.gain.real < 0, -1.0, 1.0),
            departure=ways.departure,
            arrival=ways.arrival,
            order=ways.order,
        )
    )


DIFFRACTION = Effect("diffraction", "around edges (UTD)", needed, apply)
