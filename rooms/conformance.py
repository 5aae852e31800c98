"""What every effect promises; run it on your own by its name."""

from collections.abc import Callable

import numpy as np

from rir import GainPattern, Pose
from rir.conformance import promise
from rooms.effects import EFFECTS, Tolerance
from rooms.scene import Scene
from rooms.simulation import simulate
from rooms.sound import Budget

__all__ = ["check_effect"]

SIZE = np.array([4.0, 3.0, 2.5])
OUTLINE = [(0, 0), (4, 0), (4, 1.6), (2, 1.6), (2, 3), (0, 3)]
"""Floor of an L-shaped room, m: an edge hides part of it."""
A, B = Pose.at(0.7, 2.3, 1.1, 30), Pose.at(3.1, 0.9, 1.5, 160)
"""Two places that the edge hides from each other in the L-shaped room."""
OMNI = GainPattern.omni()
RECIPROCAL_DB = -120.0
"""What the two directions may differ by: rounding of sums of many paths, no more."""


def check_effect(name: str, *, rays: int | None = None) -> None:
    """Check that an effect of the table gives reasons, and is reciprocal.

    Parameters
    ----------
    name : str
        Name in the table of effects.
    rays : int, optional
        Rays to trace in the L-shaped room, for effects that use them.

    Raises
    ------
    AssertionError
        If a promise is broken; names it.
    """
    effect = EFFECTS[name]
    promise(effect.name == name, f"{name} calls itself as the table does")
    placed = not effect.after or effect.after in EFFECTS
    promise(placed, f"{name}: stands after an effect of the table")
    for scene in (_box(), _lot(), Scene.shoebox(SIZE, absorption=1.0)):
        verdict = effect.needed(scene, Budget(16000, 4800), Tolerance())
        promise(verdict.reason, f"{name} says why it is on or off")
        promise(verdict.cost_s >= 0, f"{name} states what it costs")
        known = not any(np.isnan(error) for error in verdict.errors.values())
        promise(known, f"{name} predicts errors as numbers")
    _check_reciprocity(name, _box, None)
    _check_reciprocity(name, _lot, rays)


def _check_reciprocity(
    name: str, build: Callable[..., Scene], rays: int | None
) -> None:
    emit, hear = GainPattern.cardioid(), GainPattern.first_order(0.2)
    effects = list(dict.fromkeys(["direct", "specular", "patterns", name]))
    one, other = build(emit, hear), build(hear, emit)
    there, back = (
        simulate(
            scene,
            *ends,
            sample_rate=8000,
            duration=0.12,
            effects=effects,
            rays=rays,
        ).responses[0, 0]
        for scene, ends in ((one, (A, B)), (other, (B, A)))
    )
    error = np.linalg.norm(there - back) / np.linalg.norm(there)
    promise(
        error < 10 ** (RECIPROCAL_DB / 20),
        f"{name}: swapped devices hear the same, and differ by {error:.1e}",
    )


def _box(emit: GainPattern = OMNI, hear: GainPattern = OMNI) -> Scene:
    return Scene.shoebox(
        SIZE, absorption=0.3, scattering=0.2, emitter_gain=emit, listener_gain=hear
    )


def _lot(emit: GainPattern = OMNI, hear: GainPattern = OMNI) -> Scene:
    surfaces = {"all": {"absorption": 0.3, "scattering": 0.2}}
    return Scene.extruded(OUTLINE, 2.5, surfaces, emitter_gain=emit, listener_gain=hear)
