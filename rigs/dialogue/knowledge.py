"""What a driver knows of the position of its axes, and why not."""

from typing import Generic, TypeVar

NEVER_HOMED = "it has not been homed since it was connected"

Position = TypeVar("Position")


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
