"""What accuracy costs in time: turn a knob, get points, take the knee."""

from rir.cost.curve import CostCurve
from rir.cost.front import knee_of, mark_front
from rir.cost.measure import measure_cost, measure_costs
from rir.cost.point import CostPoint

__all__ = [
    "CostCurve",
    "CostPoint",
    "knee_of",
    "mark_front",
    "measure_cost",
    "measure_costs",
]
