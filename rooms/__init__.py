"""Simulate rooms: only the effects a scene calls for, exactly reciprocal.

Everything that comes out of here is SIMULATED.
"""

from rooms.plan import Plan, plan_effects
from rooms.scene import Scene
from rooms.simulate import Simulation, simulate
from rooms.world import MeasuredWorld, World

__all__ = [
    "MeasuredWorld",
    "Plan",
    "Scene",
    "Simulation",
    "World",
    "plan_effects",
    "simulate",
]
