"""The reciprocity report: numbers, figures and one page to show around."""

from analysis.report.write import write_report

__all__ = ["write_report"]
