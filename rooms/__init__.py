"""Simulate rooms: only the effects a scene calls for, exactly reciprocal.

Everything that comes out of here is SIMULATED. Names are loaded on first use, so
that commands start fast.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rooms.plan import Plan, plan_effects
    from rooms.scene import Scene
    from rooms.simulation import Simulation, simulate
    from rooms.world import MeasuredWorld, World

_HOME_OF = {
    "MeasuredWorld": "rooms.world",
    "Plan": "rooms.plan",
    "Scene": "rooms.scene",
    "Simulation": "rooms.simulation",
    "World": "rooms.world",
    "plan_effects": "rooms.plan",
    "simulate": "rooms.simulation",
}

__all__ = [
    "MeasuredWorld",
    "Plan",
    "Scene",
    "Simulation",
    "World",
    "plan_effects",
    "simulate",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'rooms' has no attribute {name!r}")
    return getattr(import_module(_HOME_OF[name]), name)


def __dir__() -> list[str]:
    return __all__
