"""What a session needs of whoever shows it, and a display that shows nothing."""

import logging
from typing import Protocol

from capture.devices.operator import Operator
from capture.session.journal import Event
from rir import SessionError

__all__ = ["Display", "NoDisplay"]

log = logging.getLogger(__name__)


class Display(Operator, Protocol):
    """Shows a session's events, and talks with its operator."""

    def show(self, event: Event) -> None:
        """Show an event, if it means anything to a person."""
        ...

    def progress(self, samples: int, sample_rate: int) -> None:
        """Take note of how many samples of a take are recorded."""
        ...


class NoDisplay:
    """A session run by a program: nothing is shown, nobody can be asked."""

    def show(self, event: Event) -> None:
        """Show nothing; the journal has the event."""

    def progress(self, samples: int, sample_rate: int) -> None:
        """Show nothing."""

    def say(self, text: str) -> None:
        """Log the text."""
        log.info("%s", text)

    def ask(self, text: str) -> str:
        """Refuse.

        Raises
        ------
        SessionError
            Always.
        """
        raise SessionError(f"nobody is there to answer: {text}")
