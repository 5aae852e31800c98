"""Files of other tools: sound, SOFA, and data sets in the layouts of others.

One file a format; those that hold whole data sets stand in `FORMATS`.
"""

from rir.files import meshrir, npz, sofa, wav  # noqa: F401 (enter the table)
from rir.files.table import FORMATS, Format, is_simulated

__all__ = ["FORMATS", "Format", "is_simulated"]
