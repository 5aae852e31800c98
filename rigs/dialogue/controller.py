"""Turntables and stages that speak a simple protocol, described in the rig file."""

import re
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from pydantic import Field

from rigs.clock import Clock
from rigs.controller import NEVER_HOMED, Knowledge
from rigs.faults import (
    LineError,
    RefusedError,
    SilenceError,
    StrayError,
    UnknownPositionError,
)
from rigs.lines.serial import Line
from rir.config import StrictModel
from rir.errors import OutOfReachError, RigError


class Dialogue(StrictModel):
    """What is said and answered; ``{position}``, ``{step}``, ``{steps}`` are filled in.

    ``position`` and ``step`` are in units of the axis (degrees, mm) from zero and from
    here; ``steps`` and ``step_count`` are the same as whole motor steps.
    Answers are regular expressions.
    """

    end: str = "\r\n"
    """Sent after each line, and what separates the answers."""
    start: tuple[str, ...] = ()
    """Lines sent on connecting."""
    move: str
    """The command of a move, as ``A{position:.1f}`` or ``I1M{step_count},R``."""
    acknowledge: str | None = None
    """Answer that says the command was taken."""
    refuse: str | None = None
    """Answer that says it was not."""
    done: str | None = None
    """Unasked answer that says the move has ended, as the caret of a VXM."""
    poll: str | None = None
    """Question asked until the answer matches ``idle``."""
    idle: str | None = None
    position: str | None = None
    """Question for the position; the answer's first group is the number."""
    answer: str = r"(-?\d+(?:\.\d+)?)"
    home: str | None = None
    """Command to find the reference; position 0 is wherever it stands without one."""
    stop: str | None = None


class DialogueOptions(StrictModel):
    """Axis, range, speed and dialogue of a simple controller."""

    axis: Literal["x", "y", "z", "yaw"] = "yaw"
    low: float = -180.0
    high: float = 180.0
    steps_per_unit: float = 1.0
    answer_scale: float = 1.0
    """Units of the axis per number in position answers."""
    speed: float = Field(default=10.0, gt=0)
    """Units per second; with no answer to wait for, the only clue to the end."""
    extra_s: float = Field(default=1.0, ge=0)
    """Added to each computed time."""
    tolerance: float = Field(default=0.2, gt=0)
    settle_s: float = Field(default=1.0, ge=0)
    reply_s: float = Field(default=2.0, gt=0)
    dialogue: Dialogue


class DialogueController(Knowledge[float]):
    """Drive one axis by a described dialogue.

    With neither ``done`` nor ``poll`` it runs open loop: the time computed from the
    speed is waited, and the position is what was commanded, believed until the line
    fails.
    """

    def __init__(
        self,
        line: Line,
        clock: Clock,
        options: DialogueOptions,
        *,
        simulated: bool = False,
    ) -> None:
        super().__init__()
        self.options = options
        self.axes: tuple[str, ...] = (options.axis,)
        self.simulated = simulated
        self.clock = clock
        self.line = line
        self._pending = ""

    @property
    def open_loop(self) -> bool:
        """Whether nothing tells the end of a move."""
        return self.options.dialogue.done is None and self.options.dialogue.poll is None

    def _lose(self, why: object) -> None:
        self._at = None
        self._why = str(why)

    # -- dialogue ---------------------------------------------------------------------

    def _say(self, text: str) -> None:
        self.line.write((text + self.options.dialogue.end).encode("latin-1"))

    def _await(self, pattern: str, timeout: float) -> re.Match[str]:
        """Wait for an answer; a refusal or silence raises."""
        refuse = self.options.dialogue.refuse
        deadline = self.clock.now() + timeout
        while True:
            if refuse and re.search(refuse, self._pending):
                text, self._pending = self._pending.strip(), ""
                raise RefusedError(f"the controller refused: {text!r}", 0)
            if match := re.search(pattern, self._pending):
                self._pending = self._pending[match.end() :]
                return match
            left = deadline - self.clock.now()
            if left <= 0.0:
                raise SilenceError(
                    f"no answer like {pattern!r} within {timeout:.1f} s; received "
                    f"{self._pending[-40:]!r}"
                )
            self._pending += self.line.read(left).decode("latin-1")

    def _flush(self) -> None:
        self.line.read(0.0)
        self._pending = ""

    def connect(self) -> None:
        """Open the line and send the start lines."""
        self._lose(NEVER_HOMED)
        self.line.open()
        for text in self.options.dialogue.start:
            self._say(text)
        self.clock.sleep(0.1)
        self._flush()

    def home(self) -> None:
        """Find the reference, or call the place where it stands zero.

        Raises
        ------
        RigError
            If the controller does not answer.
        """
        self._lose("homing has not finished")
        full = abs(self.options.high - self.options.low)
        dialogue = self.options.dialogue
        self._flush()
        try:
            if dialogue.home is not None:
                self._say(dialogue.home)
                self._wait_end(full)
            self._at = self._ask() if dialogue.position else 0.0
        except RigError as error:
            self._lose(error)
            raise

    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lowest and highest position."""
        return np.array([self.options.low]), np.array([self.options.high])

    def home_position(self) -> np.ndarray:
        """Return where the axis stands after homing: at zero."""
        return np.zeros(1)

    def move(self, points: Sequence[np.ndarray]) -> np.ndarray:
        """Go past all points to the last one; a move that fails loses the position."""
        o = self.options
        for point in points:
            if not o.low - 1e-9 <= float(point[0]) <= o.high + 1e-9:
                raise OutOfReachError(
                    f"{o.axis} at {float(point[0]):.3f} is outside {o.low:g} to "
                    f"{o.high:g}; choose a pose inside"
                )
        try:
            for point in points:
                self._go(float(point[0]))
        except BaseException as error:
            self._lose(f"a move was interrupted: {error}")
            if not isinstance(error, LineError | UnknownPositionError):
                self.stop()
            raise
        self.clock.sleep(o.settle_s)
        return np.array([self._at])

    def _go(self, target: float) -> None:
        at = self.verify()
        step = target - at
        if abs(step) < 1e-9:
            return
        scale = self.options.steps_per_unit
        words = {
            "position": target,
            "step": step,
            "steps": round(target * scale),
            "step_count": round(step * scale),
        }
        self._flush()
        self._say(self.options.dialogue.move.format(**words))
        if self.options.dialogue.acknowledge:
            self._await(self.options.dialogue.acknowledge, self.options.reply_s)
        self._wait_end(step)
        self._at = target
        if self.options.dialogue.position:
            here = self._ask()
            if abs(here - target) > self.options.tolerance:
                raise StrayError(
                    f"the move ended at {here:g}, {abs(here - target):.3f} from its "
                    f"target {target:g}"
                )

    def _wait_end(self, step: float) -> None:
        seconds = abs(step) / self.options.speed + self.options.extra_s
        dialogue = self.options.dialogue
        if dialogue.done is not None:
            self._await(dialogue.done, 2.0 * seconds + 5.0)
        elif dialogue.poll is not None and dialogue.idle is not None:
            self._poll(dialogue.poll, dialogue.idle, 2.0 * seconds + 5.0)
        else:
            self.clock.sleep(seconds)

    def _poll(self, question: str, idle: str, timeout: float) -> None:
        deadline = self.clock.now() + timeout
        while self.clock.now() < deadline:
            self._flush()
            self._say(question)
            try:
                self._await(idle, 0.5)
                return
            except SilenceError:
                continue
        raise SilenceError(f"it did not come to rest within {timeout:.1f} s")

    def _ask(self) -> float:
        self._flush()
        self._say(self.options.dialogue.position or "")
        match = self._await(self.options.dialogue.answer, self.options.reply_s)
        return float(match[1]) * self.options.answer_scale

    def verify(self) -> float:
        """Return the position, asked of the controller where it can tell.

        Raises
        ------
        RigError
            If it is not known, or not where it was left.
        """
        if self._at is None:
            raise UnknownPositionError(f"the position is not known: {self.why}; home")
        if not self.options.dialogue.position:
            return self._at
        try:
            here = self._ask()
        except RigError as error:
            self._lose(error)
            raise
        if abs(here - self._at) > self.options.tolerance:
            self._lose(f"the position jumped from {self._at:g} to {here:g}")
            raise StrayError(f"{self._why}; home it")
        return self._at

    def position(self) -> np.ndarray | None:
        """Ask where it is; None while that is not known."""
        try:
            return np.array([self.verify()])
        except RigError:
            return None

    def seconds(self, start: np.ndarray, end: np.ndarray) -> float:
        """Estimate the time of a move in seconds, settling included."""
        step = abs(float(end[0]) - float(start[0]))
        o = self.options
        return step / o.speed + o.extra_s + o.settle_s if step else 0.0

    def confirm(self) -> np.ndarray:
        """Return NaN: it has no means to find lost steps."""
        self.verify()
        return np.full(len(self.axes), np.nan)

    def quieten(self) -> None:
        """Check the position."""
        self.verify()

    def unquieten(self) -> None:
        """Check that nothing moved."""
        self.verify()

    def stop(self) -> None:
        """Send the stop command, if there is one."""
        if self.options.dialogue.stop is not None:
            self._say(self.options.dialogue.stop)

    def close(self) -> None:
        """Close the line."""
        self.line.finish()
        self._lose("the line was closed")

    def describe(self) -> dict[str, Any]:
        """Return plain facts for the record."""
        return {
            "axis": self.options.axis,
            "known": self.known,
            "open_loop": self.open_loop,
        }
