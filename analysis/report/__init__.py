"""The reciprocity report: numbers, figures and one page to show around."""

from analysis.report.study import StudyOptions
from analysis.report.write import write_report

__all__ = ["StudyOptions", "write_report"]
