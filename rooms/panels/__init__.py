"""How strongly faces of limited size mirror sound."""

from rooms.panels.change import FinitePanels, finite_panels
from rooms.panels.kinds import parts_of
from rooms.panels.rims import Rims, rims_of
from rooms.panels.strength import mirror_strength

__all__ = [
    "FinitePanels",
    "Rims",
    "finite_panels",
    "mirror_strength",
    "parts_of",
    "rims_of",
]
