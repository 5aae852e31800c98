"""What accuracy costs in time: turn a knob, get points, take the knee."""

from analysis.cost.curve import CostCurve, CostPoint, knee_of, mark_front
from analysis.cost.measure import measure_cost
from analysis.cost.page import cost_chart, write_cost_page

__all__ = [
    "CostCurve",
    "CostPoint",
    "cost_chart",
    "knee_of",
    "mark_front",
    "measure_cost",
    "write_cost_page",
]
