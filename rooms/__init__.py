"""Simulate rooms: only the effects a scene calls for, exactly reciprocal.

Everything that comes out of here is SIMULATED. Names are loaded on first use, so
that commands start fast.
"""

from typing import TYPE_CHECKING

from rir.lazy import lazy_names

if TYPE_CHECKING:
    from rooms.plan import EffectPlan, plan_effects
    from rooms.scene import Scene
    from rooms.simulation import Simulation, simulate
    from rooms.world import MeasuredWorld, World

__all__ = [
    "EffectPlan",
    "MeasuredWorld",
    "Scene",
    "Simulation",
    "World",
    "plan_effects",
    "simulate",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "rooms.plan": "EffectPlan plan_effects",
        "rooms.scene": "Scene",
        "rooms.simulation": "Simulation simulate",
        "rooms.world": "MeasuredWorld World",
    },
)
