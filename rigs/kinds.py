"""Every kind of rig there is: each import below enters one into the table."""

import rigs.composite
import rigs.grbl
import rigs.manual
import rigs.marlin
import rigs.simulated
import rigs.turntable  # noqa: F401
from rigs.rig import RIGS, RigKind, Surroundings

__all__ = ["RIGS", "RigKind", "Surroundings"]
