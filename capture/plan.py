"""What a session will do, as data: it can be printed and checked before it runs."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from typing import Literal

from capture.config import PlacePair, SessionConfig
from rir import Pose

__all__ = ["Measure", "Move", "SessionPlan", "Step", "Wait", "build_plan", "take_name"]

Direction = Literal["AB", "BA"]


@dataclass(frozen=True)
class Move:
    """Carry loudspeaker and microphone to the two places of a pair."""

    pair: str
    direction: Direction
    emitter: Pose
    listener: Pose

    def __str__(self) -> str:
        start, end = self.direction
        return (
            f"move loudspeaker to {self.pair}{start} {self.emitter}, "
            f"microphone to {self.pair}{end} {self.listener}"
        )


@dataclass(frozen=True)
class Wait:
    """Let the room become quiet."""

    seconds: float

    def __str__(self) -> str:
        return f"wait {self.seconds:g} s"


@dataclass(frozen=True)
class Measure:
    """Record takes of one direction until enough are good."""

    pair: str
    direction: Direction
    emitter: Pose
    listener: Pose
    takes: int = 1
    loudspeaker: int = 0
    closure: bool = False

    @property
    def key(self) -> str:
        """Name of what is measured: pair, direction, and what sets it apart."""
        speaker = f"-s{self.loudspeaker + 1}" if self.loudspeaker else ""
        closure = "-closure" if self.closure else ""
        return f"{self.pair}_{self.direction}{speaker}{closure}"

    def __str__(self) -> str:
        return f"measure {self.key}, {self.takes} take{'s' * (self.takes > 1)}"


Step = Move | Wait | Measure


@dataclass(frozen=True)
class SessionPlan:
    """The steps of a session, in order."""

    steps: tuple[Step, ...]
    """What is done."""
    take_s: float
    """Length of one take [s]."""
    move_s: float = 15.0
    """Assumed length of one move [s]."""

    @property
    def measures(self) -> list[Measure]:
        """The measuring steps alone."""
        return [step for step in self.steps if isinstance(step, Measure)]

    @property
    def moves(self) -> list[Move]:
        """The moving steps alone."""
        return [step for step in self.steps if isinstance(step, Move)]

    def seconds(self) -> float:
        """Estimate how long the steps take [s]."""
        return sum(self.step_seconds(step) for step in self.steps)

    def step_seconds(self, step: Step) -> float:
        """Estimate how long one step takes [s]."""
        if isinstance(step, Move):
            return self.move_s
        if isinstance(step, Wait):
            return step.seconds
        return step.takes * self.take_s

    def without(self, done: Collection[str]) -> "SessionPlan":
        """Return the plan of what is left when some measures are done.

        Moves and waits that lead to no remaining measure are left out.
        """
        left: list[Step] = []
        approach: list[Step] = []
        for step in self.steps:
            if isinstance(step, Move):
                approach = [step]
            elif isinstance(step, Wait):
                approach.append(step)
            elif step.key not in done:
                left += [*approach, step]
                approach = []
        return SessionPlan(tuple(left), self.take_s, self.move_s)

    def __iter__(self) -> Iterator[Step]:
        return iter(self.steps)

    def __len__(self) -> int:
        return len(self.steps)


def take_name(key: str, take_no: int) -> str:
    """Return the name of a take, which is also its file's stem.

    Examples
    --------
    >>> take_name("P01_AB", 2)
    'P01_AB_2'
    """
    return f"{key}_{take_no}"


def build_plan(config: SessionConfig, move_s: float = 15.0) -> SessionPlan:
    """Return the plan of a session.

    Each pair is measured both ways back to back; every second pair starts with
    the other direction, so that slow drift does not favour one.

    Parameters
    ----------
    config : SessionConfig
        The session.
    move_s : float
        Assumed length of one move [s], for the estimate only.
    """
    steps: list[Step] = []
    for number, pair in enumerate(config.pairs):
        order: tuple[Direction, ...] = ("AB", "BA") if number % 2 == 0 else ("BA", "AB")
        for direction in order:
            steps += _one_way(pair, direction, config)
    if config.closure:
        steps += _closure(config)
    sweep = config.sweep
    extra = config.interleaving.extra / config.sample_rate
    take_s = sweep.noise_s + sweep.seconds + extra + sweep.tail_s
    return SessionPlan(tuple(steps), take_s, move_s)


def _closure(config: SessionConfig) -> list[Step]:
    """Repeat the first direction at the end: what has drifted since shows here."""
    first = config.pairs[0]
    return [
        replace(step, closure=True, takes=1) if isinstance(step, Measure) else step
        for step in _one_way(first, "AB", config)
    ]


def _one_way(
    pair: PlacePair, direction: Direction, config: SessionConfig
) -> list[Step]:
    ends = {"A": pair.a.pose, "B": pair.b.pose}
    start, end = direction
    emitter, listener = ends[start], ends[end]
    steps: list[Step] = [Move(pair.id, direction, emitter, listener)]
    if config.settle_s:
        steps.append(Wait(config.settle_s))
    steps += [
        Measure(pair.id, direction, emitter, listener, config.takes, speaker)
        for speaker in range(len(config.channels.loudspeakers) // config.overlapping)
    ]
    return steps
