"""Data sets into and out of other tools' files."""

from capture.formats import meshrir, npz, sofa, wav  # noqa: F401 (enter the table)
from capture.formats.table import FORMATS, Format

__all__ = ["FORMATS", "Format"]
