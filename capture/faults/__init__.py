"""Everything that can go wrong with a take, for the simulated interface."""

from capture.faults import electronics, gaps, room  # noqa: F401 (enter the table)
from capture.faults.table import FAULTS, FaultScene, TakeFault, spoil

__all__ = ["FAULTS", "FaultScene", "TakeFault", "spoil"]
