"""Numbers that hold: the paper's metrics, ISO 3382 parameters, reciprocity."""

from analysis.differences import paper_metrics
from analysis.metrics import METRICS

__all__ = ["METRICS", "paper_metrics"]
