"""Numbers that hold: the paper's metrics, ISO 3382 parameters, reciprocity.

Names are loaded on first use, so that commands start fast.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from analysis.bands import band_parameters
    from analysis.differences import paper_metrics
    from analysis.metrics import METRICS
    from analysis.parameters import acoustic_parameters

_HOME_OF = {
    "METRICS": "analysis.metrics",
    "acoustic_parameters": "analysis.parameters",
    "band_parameters": "analysis.bands",
    "paper_metrics": "analysis.differences",
}

__all__ = ["METRICS", "acoustic_parameters", "band_parameters", "paper_metrics"]


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'analysis' has no attribute {name!r}")
    return getattr(import_module(_HOME_OF[name]), name)


def __dir__() -> list[str]:
    return __all__
