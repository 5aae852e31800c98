"""Numbers that hold: the paper's metrics, ISO 3382 parameters, reciprocity.

Names are loaded on first use, so that commands start fast.
"""

from typing import TYPE_CHECKING

from rir.lazy import lazy_names

if TYPE_CHECKING:
    from analysis.bands import band_parameters
    from analysis.differences import paper_metrics
    from analysis.metrics import METRICS
    from analysis.parameters import acoustic_parameters
    from analysis.report import StudyOptions, write_report
    from analysis.sound_strength import reference_energy, strength

__all__ = [
    "METRICS",
    "StudyOptions",
    "acoustic_parameters",
    "band_parameters",
    "paper_metrics",
    "reference_energy",
    "strength",
    "write_report",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "analysis.bands": "band_parameters",
        "analysis.differences": "paper_metrics",
        "analysis.metrics": "METRICS",
        "analysis.parameters": "acoustic_parameters",
        "analysis.report": "StudyOptions write_report",
        "analysis.sound_strength": "reference_energy strength",
    },
)
