"""Every kind of rig there is: each import below enters one into the table."""

import rigs.kinds.composite
import rigs.kinds.grbl
import rigs.kinds.manual
import rigs.kinds.marlin
import rigs.kinds.simulated
import rigs.kinds.turntable  # noqa: F401
from rigs.rig import RIGS, RigKind, Surroundings

__all__ = ["RIGS", "RigKind", "Surroundings"]
