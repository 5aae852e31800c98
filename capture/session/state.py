"""What a journal says has been done: the starting point of a resumed session."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from capture.devices.movers import MENDED
from capture.plan import Measure, SessionPlan
from capture.session.journal import Event

__all__ = ["SessionState", "TakeState"]


@dataclass(frozen=True)
class TakeState:
    """One take that was recorded, good or not."""

    name: str
    key: str
    take_no: int
    event: Event

    @property
    def accepted(self) -> bool:
        """Whether the take passed its checks and its file is whole."""
        return bool(self.event.get("accepted"))


@dataclass
class SessionState:
    """The sum of a session's events.

    Attributes
    ----------
    takes : dict of str to TakeState
        Recorded takes by name; a later event about the same take replaces the
        earlier one, so that no take can count twice.
    started : dict of str to dict
        The last ``take_started`` event of each take; what was mended right before it
        is in its "mended".
    notes : list of str
        What the operator and the rigs had to say.
    """

    takes: dict[str, TakeState] = field(default_factory=dict)
    started: dict[str, Event] = field(default_factory=dict)
    used: dict[str, int] = field(default_factory=dict)
    first: Event = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    mended: list[str] = field(default_factory=list)
    """What was mended since the last take began."""

    @staticmethod
    def of(events: Iterable[Event]) -> "SessionState":
        """Return the state after some events."""
        state = SessionState()
        for event in events:
            state.add(event)
        return state

    def add(self, event: Event) -> None:
        """Take one more event into account."""
        kind = event["event"]
        if kind == "session_started":
            self.first = event
        elif kind == "take_started":
            self.started[event["take"]] = {**event, "mended": self.mended}
            self.mended = []
        elif kind == "note":
            self.notes.append(event["text"])
            if event["text"].startswith(MENDED):
                self.mended = [*self.mended, event["text"]]
        elif kind == "take_finished":
            # Figures stay in the journal: a week of them would fill the memory.
            kept = {key: value for key, value in event.items() if key != "figures"}
            take = TakeState(event["take"], event["key"], event["take_no"], kept)
            self.takes[take.name] = take
        elif kind == "take_dropped":
            self.takes.pop(event["take"], None)
        elif kind == "take_rejected":
            self._reject(event["take"], event["reason"])
        elif kind == "take_failed":
            self._used(event["key"], event["take_no"])

    def _reject(self, name: str, reason: str) -> None:
        """Turn a good take into a bad one, found to be so afterwards."""
        take = self.takes.get(name)
        if take is not None:
            event = {**take.event, "accepted": False, "reasons": [reason]}
            self.takes[name] = TakeState(name, take.key, take.take_no, event)

    def _used(self, key: str, take_no: int) -> None:
        """Remember that a take's number is not to be given again."""
        self.used[key] = max(take_no, self.used.get(key, 0))

    def accepted(self, key: str) -> list[TakeState]:
        """Return the good takes of a measure, in order."""
        takes = (take for take in self.takes.values() if take.key == key)
        return sorted(
            (take for take in takes if take.accepted), key=lambda take: take.take_no
        )

    def next_take(self, key: str) -> int:
        """Return the number of the next take of a measure."""
        numbers = [take.take_no for take in self.takes.values() if take.key == key]
        return 1 + max([0, self.used.get(key, 0), *numbers])

    def missing(self, measure: Measure) -> int:
        """Return how many good takes a measure still needs."""
        return max(0, measure.takes - len(self.accepted(measure.key)))

    def done(self, plan: SessionPlan) -> set[str]:
        """Return the keys of the measures that need nothing more."""
        return {step.key for step in plan.measures if not self.missing(step)}
