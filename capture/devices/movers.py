"""Who brings loudspeaker and microphone to their places: two rigs, or a person."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from itertools import pairwise
from math import isfinite
from typing import Any, Protocol

from capture.plan import Move
from rigs import Carriers, Clock
from rigs.kinds.manual import instruction
from rir import Pose, RigError, RoomSpec

__all__ = ["MENDED", "Mover", "Person", "Redo", "RedoNow", "RigPair", "Skip"]


SAMPLED = 12  # moves for a mean within a few seconds, planned in a moment
UNKNOWN_MOVE_S = 15.0  # a few metres at 0.3 m/s, with settling
MENDED = "rig homed again: "
"""How a note begins that tells of a rig fault; the next take is marked with it."""


class Skip(Exception):  # noqa: N818 (a request of the operator, not an error)
    """The operator leaves this direction out for now."""


class Redo(Exception):  # noqa: N818
    """The operator wants the last direction measured again."""


class RedoNow(Exception):  # noqa: N818
    """The operator wants the direction just measured again."""


class Mover(Protocol):
    """Anything that brings both devices to their places."""

    @property
    def simulated(self) -> bool:
        """Whether the places exist in a computer only."""
        ...

    def check(self, step: Move) -> None:
        """Raise `OutOfReachError` if the places cannot be had; move nothing."""
        ...

    def prepare(self) -> None:
        """Get ready for the first place; ask before anything moves."""
        ...

    def mend(self, error: RigError) -> None:
        """Get ready again after a fault, or raise it."""
        ...

    def place(self, step: Move) -> tuple[Pose, Pose]:
        """Bring both to their places and return the poses reached."""
        ...

    def doubt(self, text: str) -> bool:
        """Tell what looks wrong with a pair; return whether to measure it again."""
        ...

    def seconds(self, moves: Sequence[Move]) -> float:
        """Estimate the mean length of some moves in a row [s]."""
        ...

    def quiet(self) -> AbstractContextManager[None]:
        """Keep still and silent inside the block."""
        ...

    def stop(self) -> None:
        """Stop any motion at once."""
        ...

    def close(self) -> None:
        """Release the devices."""
        ...

    def describe(self) -> dict[str, Any]:
        """Return what a data set should remember."""
        ...


class RigPair:
    """Two rigs under the program's control.

    Parameters
    ----------
    carriers : Carriers
        The rigs.
    ask : callable, optional
        Asks a person whether a rig that has lost its position may be homed.
    homing : bool
        Whether the rigs need homing before their first move.
    note : callable, optional
        Takes what happened into the journal.
    """

    def __init__(
        self,
        carriers: Carriers,
        *,
        ask: Callable[[str], bool] | None = None,
        homing: bool = False,
        note: Callable[[str], None] | None = None,
    ) -> None:
        self.carriers = carriers
        self.homing = homing
        self._ask = ask
        self._note = note

    @property
    def simulated(self) -> bool:
        """Whether either rig is simulated."""
        return self.carriers.simulated

    def check(self, step: Move) -> None:
        """Ask the rigs whether the places are in reach."""
        self.carriers.check(step.emitter, step.listener)

    def prepare(self) -> None:
        """Home rigs that do not know where they are, if a person agrees.

        Raises
        ------
        RigError
            If nobody agrees.
        """
        if self.homing and None in self.carriers.where():
            self._home(RigError("the rigs do not know where they are"))

    def mend(self, error: RigError) -> None:
        """Home what is lost after a fault, if a person agrees; else raise the fault."""
        self._home(error)
        if self._note is not None:
            self._note(f"{MENDED}{error}")

    def _home(self, error: RigError) -> None:
        question = f"{error}. Home the rigs now? They will move. [y/N]"
        if self._ask is None or not self._ask(question):
            raise error
        self.carriers.home()

    def place(self, step: Move) -> tuple[Pose, Pose]:
        """Move both; after a fault, home and try once more if a person agrees.

        Raises
        ------
        RigError
            If a rig did not arrive.
        """
        try:
            return self.carriers.place(step.emitter, step.listener)
        except RigError as error:
            self.mend(error)
        return self.carriers.place(step.emitter, step.listener)

    def doubt(self, text: str) -> bool:
        """Go on: rigs do not mix up stands, the mark in the journal is enough."""
        del text
        return False

    def seconds(self, moves: Sequence[Move]) -> float:
        """Return the mean length of the first moves, as the rigs plan them [s]."""
        poses = [(move.emitter, move.listener) for move in moves[:SAMPLED]]
        lengths = [self.carriers.duration(start, end) for start, end in pairwise(poses)]
        known = [length for length in lengths if isfinite(length)]
        return sum(known) / len(known) if known else UNKNOWN_MOVE_S

    def quiet(self) -> AbstractContextManager[None]:
        """Keep the rigs still and silent."""
        return self.carriers.quiet()

    def stop(self) -> None:
        """Stop both."""
        self.carriers.stop()

    def close(self) -> None:
        """Release both."""
        self.carriers.close()

    def describe(self) -> dict[str, Any]:
        """Return what both say of themselves."""
        return self.carriers.describe()


HELP = (
    "[Enter] start  [d] start after 10 s more  [s] skip  [r] redo last  "
    "[n] note  [p] pause  [q] quit"
)
COUNTDOWN_S = 5.0  # to stand still and hold one's breath
DELAY_S = 10.0  # to leave the room and close its door


class Person:
    """Somebody who carries the stands, told by prompts what to do.

    Parameters
    ----------
    room : RoomSpec
        Where the places must be.
    ask : callable
        Shows a text, waits for a line and returns it.
    tell : callable
        Shows a text.
    note : callable
        Takes what the operator wants written into the journal.
    clock : Clock
        Passes the countdown.
    placed : sequence of callable
        Told the poses of loudspeaker and microphone: a simulated world, if there is
        one.
    """

    simulated = False

    def __init__(
        self,
        room: RoomSpec,
        *,
        ask: Callable[[str], str],
        tell: Callable[[str], None],
        note: Callable[[str], None],
        clock: Clock,
        placed: Sequence[Callable[[Pose], None]] = (),
    ) -> None:
        self._placed = placed
        self.room = room
        self._ask, self._tell, self._note = ask, tell, note
        self._clock = clock
        self._last: Move | None = None

    def check(self, step: Move) -> None:
        """Check that both places are inside the room."""
        for pose in (step.emitter, step.listener):
            self.room.check_inside(pose.position)

    def place(self, step: Move) -> tuple[Pose, Pose]:
        """Prompt until the stands are where they should be, then count down.

        Raises
        ------
        Skip, Redo, KeyboardInterrupt
            If the operator asks to skip, to redo the last direction, or to quit.
        """
        self._tell(self._orders(step))
        self._count_down(self._wait_for_start())
        self._last = step
        for call, pose in zip(
            self._placed, (step.emitter, step.listener), strict=False
        ):
            call(pose)
        return step.emitter, step.listener

    def prepare(self) -> None:
        """Do nothing: the first prompt tells all."""

    def mend(self, error: RigError) -> None:
        """Raise the fault: a person has nothing to home."""
        raise error

    def _orders(self, step: Move) -> str:
        start, end = step.direction
        last = self._last
        swap = last is not None and last.pair == step.pair
        head = "SWAP the stands: " if swap else ""
        return (
            f"{head}{step.pair}{start}: {instruction('loudspeaker', step.emitter)}\n"
            f"{step.pair}{end}: {instruction('microphone', step.listener)}\n"
            "front marks facing each other; leave, close the door"
        )

    def _wait_for_start(self) -> float:
        """Return the seconds to wait once the operator says start."""
        while True:
            answer = self._ask(HELP).strip().lower()
            if answer == "":
                return COUNTDOWN_S
            if answer == "d":
                return COUNTDOWN_S + DELAY_S
            if answer == "s":
                raise Skip
            if answer == "r":
                raise Redo
            if answer == "q":
                raise KeyboardInterrupt
            if answer == "n":
                self._note(self._ask("note:"))
            elif answer == "p":
                self._ask("paused; [Enter] goes on")
            else:
                self._tell(f"{answer!r} is none of the keys")

    def _count_down(self, seconds: float) -> None:
        while seconds > 0:
            self._tell(f"starting in {seconds:.0f} s")
            self._clock.sleep(min(1.0, seconds))
            seconds -= 1.0

    def doubt(self, text: str) -> bool:
        """Ask whether the direction just measured shall be measured again."""
        question = f"{text} Measure this direction again? [y/N]"
        return self._ask(question).strip().lower() in {"y", "yes"}

    def seconds(self, moves: Sequence[Move]) -> float:
        """Return how long a person takes [s]."""
        del moves
        return 60.0

    def quiet(self) -> AbstractContextManager[None]:
        """Trust that the person is outside."""
        return nullcontext()

    def stop(self) -> None:
        """Do nothing: nothing moves by itself."""

    def close(self) -> None:
        """Release nothing."""

    def describe(self) -> dict[str, Any]:
        """Return that a person moved everything."""
        return {"kind": "person", "simulated": False}
