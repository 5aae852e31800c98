"""What a session has done so far: every event passes through here."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from capture.session.journal import Event, Journal
from capture.session.state import SessionState

__all__ = ["SessionRecord"]


def _silent(event: Event) -> None:
    del event


@dataclass
class SessionRecord:
    """The journal of a session, what it adds up to, and who sees it grow."""

    journal: Journal
    """The open journal."""
    utc: Callable[[], str]
    """Returns the time of day as ISO 8601 text."""
    show: Callable[[Event], None] = _silent
    """Shown every event, those too that are not journalled."""

    def __post_init__(self) -> None:
        self.state = SessionState.of(self.journal)

    def add(self, event: dict[str, Any]) -> None:
        """Journal an event, then take it into account and show it."""
        event = {**event, "time": self.utc()}
        self.journal.write(event)
        self.state.add(event)
        self.show(event)

    def note(self, text: str) -> None:
        """Journal what the operator or a rig has to say."""
        self.add({"event": "note", "text": text})
