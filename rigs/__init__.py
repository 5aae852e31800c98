"""Carry loudspeaker and microphone to poses, and never lie about where they are."""

# each import enters a kind of rig into the table
import rigs.composite
import rigs.grbl
import rigs.manual
import rigs.marlin
import rigs.simulated
import rigs.turntable  # noqa: F401
from rigs.carriers import Carriers
from rigs.clock import Clock, FastClock, SystemClock, VirtualClock
from rigs.envelope import Envelope, KeepOut
from rigs.manual import ManualRig
from rigs.rig import RIGS, Rig, RigKind, Surroundings
from rigs.rigfile import load_rig
from rigs.simulated import SimulatedRig

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
