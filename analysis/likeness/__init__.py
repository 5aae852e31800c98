"""How alike the two directions of a pair are, and why not."""

from analysis.likeness.faults import FaultLimits, PairFault, name_faults, position_error
from analysis.likeness.fit import SwapFit, fit_swap, warped
from analysis.likeness.room import RoomLikeness, fit_room

__all__ = [
    "FaultLimits",
    "PairFault",
    "RoomLikeness",
    "SwapFit",
    "fit_room",
    "fit_swap",
    "name_faults",
    "position_error",
    "warped",
]
