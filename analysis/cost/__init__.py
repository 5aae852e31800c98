"""What accuracy costs, drawn; the measuring itself is `rir.cost`."""

from analysis.cost.page import cost_chart, write_cost_page
from rir.cost import CostCurve, CostPoint, knee_of, mark_front, measure_cost

__all__ = [
    "CostCurve",
    "CostPoint",
    "cost_chart",
    "knee_of",
    "mark_front",
    "measure_cost",
    "write_cost_page",
]
