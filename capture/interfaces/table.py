"""The table of audio interfaces."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from capture.config import SessionConfig
from capture.interfaces.protocol import AudioInterface
from rir import Registry

__all__ = ["INTERFACES", "InterfaceKind", "InterfaceSurroundings", "WorldView"]


@runtime_checkable
class WorldView(Protocol):
    """What a simulated interface asks of the simulated world."""

    def responses(self, output: int = 0) -> NDArray[np.float64]:
        """Return one loudspeaker's response at each listener, (listeners, n)."""
        ...


@dataclass(frozen=True)
class InterfaceSurroundings:
    """What an interface may need from the program around it."""

    world: WorldView | None = None
    """The simulated room, for simulated interfaces."""
    on_progress: Callable[[int], None] | None = None
    """Told how many samples of a take are recorded, where that takes time."""


@dataclass(frozen=True)
class InterfaceKind:
    """One kind of interface and how it is opened."""

    about: str
    """One line for the lists."""
    open: Callable[[SessionConfig, InterfaceSurroundings], AudioInterface]
    """Opens it for a session."""


INTERFACES: Registry[InterfaceKind] = Registry(
    "audio interface", "resounding.interfaces", InterfaceKind
)
