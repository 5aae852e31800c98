"""What every rig can do, and the table of the kinds of rig there are."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np
from pydantic import BaseModel

from rigs.clock import Clock, SystemClock
from rigs.planning.envelope import Envelope
from rir.pose import Pose
from rir.registry import Registry


@runtime_checkable
class Rig(Protocol):
    """Carry one device (loudspeaker or microphone) to poses in the room frame.

    Only `move` and `home` set anything in motion.
    """

    name: str
    simulated: bool

    @property
    def envelope(self) -> Envelope | None:
        """Where it may be; None where only a person knows."""
        ...

    def check(self, pose: Pose) -> None:
        """Raise `OutOfReachError` if the pose cannot be reached; move nothing."""
        ...

    def move(self, pose: Pose, via: Sequence[Pose] = ()) -> Pose:
        """Go to a pose, past way-points, wait until settled, return the pose reached.

        Raises
        ------
        OutOfReachError
            Before anything moves, if the pose or a way-point is out of reach.
        RigError
            If the rig did not get there, or where it is has become unknown.
        """
        ...

    def connect(self) -> None:
        """Open what has to be opened and find out what is there; move nothing."""
        ...

    def home(self) -> None:
        """Find the reference, connecting first; afterwards the position is known."""
        ...

    def homing_sweep(self) -> np.ndarray:
        """Return boxes that hold any way homing may take, shape (N, 2, 3), m."""
        ...

    def whereabouts(self) -> np.ndarray:
        """Return the straight ways it may be on, shape (N, 2, 3), m."""
        ...

    def where(self) -> Pose | None:
        """Return the pose, asked of the rig itself; None while it is unknown."""
        ...

    def confirm(self) -> float:
        """Compare with the reference and return the drift in m, NaN if unable.

        Raises
        ------
        RigError
            If steps were lost; the position is unknown then.
        """
        ...

    def reference_place(self) -> np.ndarray | None:
        """Return where `confirm` goes, m; None if it moves nothing."""
        ...

    def trouble(self) -> str:
        """Return why the rig must be homed before it can move; nothing if it can."""
        ...

    def quiet(self) -> AbstractContextManager[None]:
        """Keep silent and still inside the block; raise `RigError` if it moved."""
        ...

    def duration(self, start: Pose, end: Pose) -> float:
        """Estimate the seconds a move takes, settling included."""
        ...

    def stop(self) -> None:
        """Stop any motion at once."""
        ...

    def close(self) -> None:
        """Release the line or device; a second call does nothing."""
        ...

    def describe(self) -> dict[str, Any]:
        """Return what a data set should remember about the rig, as plain values."""
        ...


def _say_nothing(text: str) -> None:
    """Show nothing."""
    del text


def _refuse(question: str) -> bool:
    """Answer no to every question: consent is never assumed."""
    del question
    return False


@dataclass(frozen=True)
class Surroundings:
    """What a rig needs from the program around it."""

    on_pose: Callable[[Pose], None] | None = None
    """Told the true pose after each simulated motion."""
    clock: Clock = field(default_factory=SystemClock)
    """Time for everything that waits."""
    ask: Callable[[str], bool] = _refuse
    """Asks a person for consent (homing after a power loss); no by default."""
    tell: Callable[[str], None] = _say_nothing
    """Shows a person what happens."""


@dataclass(frozen=True)
class RigKind:
    """One kind of rig: how its part of a rig file looks and how it is built."""

    about: str
    """One line for the lists."""
    config: type[BaseModel]
    """The model its part of a rig file is checked against."""
    build: Callable[[Any, Surroundings], Rig]
    """Makes the rig from the checked configuration."""


RIGS: Registry[RigKind] = Registry("rig", "resounding.rigs", RigKind)
