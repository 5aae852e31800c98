"""Carry loudspeaker and microphone to poses, and never lie about where they are.

Names are loaded on first use, so that commands start fast.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rigs.carriers import Carriers
    from rigs.clock import Clock, FastClock, SystemClock, VirtualClock
    from rigs.envelope import Envelope, KeepOut
    from rigs.kinds import RIGS, RigKind, Surroundings
    from rigs.manual import ManualRig
    from rigs.rig import Rig
    from rigs.rigfile import load_rig
    from rigs.simulated import SimulatedRig

_HOMES = {
    "rigs.carriers": "Carriers",
    "rigs.clock": "Clock FastClock SystemClock VirtualClock",
    "rigs.envelope": "Envelope KeepOut",
    "rigs.kinds": "RIGS RigKind Surroundings",
    "rigs.manual": "ManualRig",
    "rigs.rig": "Rig",
    "rigs.rigfile": "load_rig",
    "rigs.simulated": "SimulatedRig",
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names.split()}

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


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'rigs' has no attribute {name!r}")
    return getattr(import_module(_HOME_OF[name]), name)
