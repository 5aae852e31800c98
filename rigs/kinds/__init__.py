"""Every kind of rig there is: each import below enters one into the table."""

from rigs.kinds import (  # noqa: F401
    composite,
    grbl,
    manual,
    marlin,
    simulated,
    turntable,
)
from rigs.rig import RIGS, RigKind, Surroundings

__all__ = ["RIGS", "RigKind", "Surroundings"]
