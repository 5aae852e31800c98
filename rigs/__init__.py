"""Carry loudspeaker and microphone to poses, and never lie about where they are.

Names are loaded on first use, so that commands start fast.
"""

from typing import TYPE_CHECKING

from rir.lazy import lazy_names

if TYPE_CHECKING:
    from rigs.carriers import Carriers
    from rigs.clock import Clock, FastClock, SystemClock, VirtualClock
    from rigs.kinds import RIGS, RigKind, Surroundings
    from rigs.kinds.manual import ManualRig
    from rigs.kinds.simulated import SimulatedRig
    from rigs.planning.envelope import Envelope, KeepOut
    from rigs.rig import Rig
    from rigs.rigfile import load_rig

__all__ = [
    "RIGS",
    "Carriers",
    "Clock",
    "Envelope",
    "FastClock",
    "KeepOut",
    "ManualRig",
    "Rig",
    "RigKind",
    "SimulatedRig",
    "Surroundings",
    "SystemClock",
    "VirtualClock",
    "load_rig",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "rigs.carriers": "Carriers",
        "rigs.clock": "Clock FastClock SystemClock VirtualClock",
        "rigs.planning.envelope": "Envelope KeepOut",
        "rigs.kinds": "RIGS RigKind Surroundings",
        "rigs.kinds.manual": "ManualRig",
        "rigs.rig": "Rig",
        "rigs.rigfile": "load_rig",
        "rigs.kinds.simulated": "SimulatedRig",
    },
)
