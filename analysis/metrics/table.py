"""The table of metrics; its own file, so that each metric can enter itself."""

from analysis.metrics.metric import Metric
from rir.registry import Registry

__all__ = ["METRICS"]

METRICS: Registry[Metric] = Registry("metric", "resounding.metrics", Metric)
