"""What a driver of a motion controller offers to the rig, and what it knows."""

from collections.abc import Sequence
from enum import StrEnum
from typing import Any, Generic, Protocol, TypeVar, runtime_checkable

import numpy as np

NEVER_HOMED = "it has not been homed since it was connected"

Position = TypeVar("Position")


class State(StrEnum):
    """What a controller does, in Grbl's words where its reports have one."""

    DISCONNECTED = "Disconnected"
    CONNECTING = "Connecting"
    IDLE = "Idle"
    MOVING = "Moving"
    HOLDING = "Holding"
    RUN = "Run"
    JOG = "Jog"
    HOLD = "Hold"
    DOOR = "Door"
    HOME = "Home"
    ALARM = "Alarm"
    CHECK = "Check"
    SLEEP = "Sleep"
    STOPPED = "Stopped"
    FAULT = "Fault"


@runtime_checkable
class Controller(Protocol):
    """Move some axes, in millimetres and degrees of the machine's own frame."""

    axes: tuple[str, ...]
    """Names of the axes it moves, of x, y, z and yaw."""
    simulated: bool

    @property
    def known(self) -> bool:
        """Whether the position is known since the last homing."""
        ...

    @property
    def why(self) -> str:
        """Why the position is not known."""
        ...

    def connect(self) -> None:
        """Open the line and find out what is at its end; move nothing."""
        ...

    def home(self) -> None:
        """Find the reference."""
        ...

    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lowest and highest position of each axis."""
        ...

    def home_position(self) -> np.ndarray:
        """Return where each axis stands after homing."""
        ...

    def move(self, points: Sequence[np.ndarray]) -> np.ndarray:
        """Go past all points to the last one; return where it came to rest.

        Raises
        ------
        OutOfReachError
            Before anything moves.
        RigError
            If it did not get there; it has been stopped where its line still answers.
        """
        ...

    def position(self) -> np.ndarray | None:
        """Ask where it is; None while that is not known."""
        ...

    def confirm(self) -> np.ndarray:
        """Compare with the reference; return the drift of each axis, NaN if unable."""
        ...

    def quieten(self) -> None:
        """Switch off what makes noise; check that it stands where it should."""
        ...

    def unquieten(self) -> None:
        """Undo `quieten`; raise `RigError` if anything happened meanwhile."""
        ...

    def seconds(self, start: np.ndarray, end: np.ndarray) -> float:
        """Estimate the time of a move."""
        ...

    def stop(self) -> None:
        """Stop at once, keeping the position if that is possible."""
        ...

    def close(self) -> None:
        """Close the line."""
        ...

    def describe(self) -> dict[str, Any]:
        """Return plain facts for the record."""
        ...


class Knowledge(Generic[Position]):
    """The position a controller was left at, until something makes it unsure."""

    def __init__(self) -> None:
        self._at: Position | None = None
        self._why = NEVER_HOMED

    @property
    def known(self) -> bool:
        """Whether the position is known since the last homing."""
        return self._at is not None

    @property
    def why(self) -> str:
        """Why the position is not known."""
        return "" if self.known else self._why

    def _lose(self, why: object) -> None:
        self._at = None
        self._why = str(why)
