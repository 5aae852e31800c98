"""Marlin boards: numbered, checksummed lines, and M400 as the barrier."""

from collections import deque
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from pydantic import Field

from rigs.clock import Clock
from rigs.controller import NEVER_HOMED, Knowledge, State
from rigs.faults import (
    LineError,
    RebootError,
    RefusedError,
    SilenceError,
    StrayError,
    UnknownPositionError,
)
from rigs.lines.serial import Line
from rigs.marlin.parsing import Reply, checksummed, read_reply, vector
from rigs.motion import travel_time
from rir.config import StrictModel
from rir.errors import OutOfReachError, RigError

RESENDS = 6  # of one line: so many damaged in a row are a broken line, not noise


class MarlinOptions(StrictModel):
    """Options of one Marlin board, which does not tell its travel itself."""

    axes: tuple[str, ...] = ("x", "y", "z")
    low_mm: tuple[float, ...] = (0.0, 0.0, 0.0)
    high_mm: tuple[float, ...] = (200.0, 200.0, 200.0)
    feed_mm_per_min: float = Field(default=3000.0, gt=0)
    acceleration_mm_per_s2: float = Field(default=200.0, gt=0)
    tolerance_mm: float = Field(default=0.02, gt=0)
    settle_s: float = Field(default=1.0, ge=0)
    reply_s: float = Field(default=5.0, gt=0)
    homing_s: float = Field(default=120.0, gt=0)
    boot_s: float = Field(default=3.0, ge=0)
    quiet: tuple[str, ...] = ()
    """Lines sent before each recording, as M107 for the fan."""
    loud: tuple[str, ...] = ()


class MarlinController(Knowledge[np.ndarray]):
    """Drive one Marlin board.

    Every line carries a number, so a board that has restarted gives itself away: it
    asks for line 1 again. There is no way to stop in an orderly manner, so a stop
    loses the position.
    """

    def __init__(
        self,
        line: Line,
        clock: Clock,
        options: MarlinOptions | None = None,
        *,
        simulated: bool = False,
    ) -> None:
        super().__init__()
        self.options = options or MarlinOptions()
        self.axes = self.options.axes
        self.simulated = simulated
        self.clock = clock
        self.line = line
        self.firmware = ""
        self.state: str = State.DISCONNECTED
        self._number = 0
        self._partial = b""
        self._replies: deque[Reply] = deque()

    # -- dialogue ---------------------------------------------------------------------

    def _next(self, timeout: float) -> Reply | None:
        deadline = self.clock.now() + timeout
        while not self._replies:
            left = max(0.0, deadline - self.clock.now())
            *lines, self._partial = (self._partial + self.line.read(left)).split(b"\n")
            texts = (raw.decode("latin-1").strip() for raw in lines)
            self._replies.extend(read_reply(text) for text in texts if text)
            if not self._replies and self.clock.now() >= deadline:
                return None
        return self._replies.popleft()

    def _drain(self) -> None:
        while (reply := self._next(0.0)) is not None:
            self._raise_events(reply)

    def _raise_events(self, reply: Reply) -> None:
        if reply.kind == "start":
            raise RebootError(
                "the controller restarted by itself; its position is lost; home it"
            )

    def command(self, text: str, timeout: float | None = None) -> list[Reply]:
        """Send one numbered line until the board has taken it; return its replies.

        Raises
        ------
        RefusedError, RebootError, SilenceError
            As the board answers, or does not.
        """
        self._drain()
        self._number += 1
        silences = 0
        for _ in range(RESENDS):
            self.line.write(checksummed(self._number, text).encode() + b"\n")
            try:
                replies = self._await_ok(text, timeout or self.options.reply_s)
            except SilenceError:
                silences += 1
                if silences > 1:
                    raise
                continue
            if replies is not None:
                return replies
        raise SilenceError(f"the board asked for {text!r} again {RESENDS} times")

    def _await_ok(self, text: str, timeout: float) -> list[Reply] | None:
        """Return the replies up to ok; None if the line has to be sent again.

        No replies at all, not even the ok, mean that the line was taken and its ok
        was lost: the board asks for the line after it.
        """
        deadline = self.clock.now() + timeout
        replies: list[Reply] = []
        resend: Reply | None = None
        while (left := deadline - self.clock.now()) >= 0.0:
            reply = self._next(left)
            if reply is None:
                break
            self._raise_events(reply)
            if reply.kind == "busy":
                deadline = self.clock.now() + timeout
            elif reply.kind == "resend":
                resend = reply
            elif reply.kind == "ok":
                return self._judge(resend, [*replies, reply])
            elif reply.kind == "error" and not _about_numbering(reply.text):
                raise RefusedError(f"the board says {reply.text!r} to {text!r}", 0)
            replies.append(reply)
        raise SilenceError(f"no ok to {text!r} within {timeout:.1f} s")

    def _judge(self, resend: Reply | None, replies: list[Reply]) -> list[Reply] | None:
        if resend is None:
            return replies
        damaged = any("checksum" in r.text.lower() for r in replies)
        if resend.number == self._number or (damaged and resend.number > self._number):
            # some boards count repeated lines, and then ask for a later number
            self._number = resend.number
            return None
        if resend.number == self._number + 1:
            return []
        raise RebootError(
            f"the board asks for line {resend.number} where {self._number} was sent: "
            "it has restarted or lost lines; home it again"
        )

    def _barrier(self, timeout: float) -> None:
        """Wait until all motion has ended; a lost ok proves nothing, so ask again."""
        for _ in range(3):
            if self.command("M400", timeout):
                return
        raise SilenceError("the end of the move was not acknowledged")

    # -- as a controller --------------------------------------------------------------

    def connect(self) -> None:
        """Open the line, read the firmware's name, number the lines from 0.

        Raises
        ------
        RigError
            If nothing answers like Marlin.
        """
        self._lose(NEVER_HOMED)
        self.state = State.CONNECTING
        self.line.open()
        while (reply := self._next(self.options.boot_s)) is not None:
            if reply.kind == "other" and reply.text == "wait":
                break
        self._replies.clear()
        self._renumber()
        names = [r.text for r in self.command("M115") if "FIRMWARE_NAME" in r.text]
        if not names:
            raise RigError("the board does not tell a FIRMWARE_NAME; is it Marlin?")
        self.firmware = names[0].partition("FIRMWARE_NAME:")[2]
        self.state = State.IDLE

    def home(self) -> None:
        """Run G28; afterwards the position is known.

        Raises
        ------
        RigError
            If the board does not finish.
        """
        self._lose("homing has not finished")
        try:
            self._renumber()
            self.command("G21")
            self.command("G90")
            self.command("G28", self.options.homing_s)
            self._barrier(self.options.homing_s)
            self._at = self._ask()
        except RigError as error:
            self._lose(error)
            raise
        self.state = State.IDLE

    def _renumber(self) -> None:
        while self._next(0.2) is not None:
            pass
        self._number = 0
        self.line.write(checksummed(0, "M110 N0").encode() + b"\n")
        if self._await_ok("M110", self.options.reply_s) is None:
            raise RigError("the board did not take a new line number; reset it")

    def _ask(self) -> np.ndarray:
        for _ in range(3):
            for reply in self.command("M114"):
                if reply.place:
                    return vector(reply.place)[: len(self.axes)]
        raise SilenceError("the board answered M114 without a position")

    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lowest and highest position of each axis, mm."""
        return np.array(self.options.low_mm), np.array(self.options.high_mm)

    def home_position(self) -> np.ndarray:
        """Return where each axis stands after homing: at zero."""
        return np.zeros(len(self.axes))

    def move(self, points: Sequence[np.ndarray]) -> np.ndarray:
        """Go past all points to the last one; a move that fails loses the position."""
        low, high = self.limits()
        for point in points:
            if not np.all((point >= low - 1e-9) & (point <= high + 1e-9)):
                raise OutOfReachError(
                    f"machine {np.round(point, 3).tolist()} mm is outside "
                    f"{low.tolist()} to {high.tolist()}; choose a pose inside"
                )
        path = [self.verify(), *points]
        self.state = State.MOVING
        try:
            self._go(path)
        except BaseException as error:
            self._give_up(error)
            raise
        self.state = State.IDLE
        return self.verify()

    def _go(self, path: list[np.ndarray]) -> None:
        for point in path[1:]:
            words = " ".join(f"{'XYZ'[k]}{v + 0.0:.3f}" for k, v in enumerate(point))
            self.command(f"G1 {words} F{self.options.feed_mm_per_min:g}")
        seconds = sum(self.seconds(a, b) for a, b in pairwise(path))
        self._barrier(10.0 + 2.0 * seconds)
        here = self._ask()
        off = float(np.max(np.abs(here - path[-1])))
        if off > self.options.tolerance_mm:
            raise StrayError(f"the move ended {off:.3f} mm from its target")
        self.clock.sleep(self.options.settle_s)
        self._at = here

    def _give_up(self, error: BaseException) -> None:
        self._lose(f"a move was interrupted: {error}")
        self.state = State.FAULT
        if not isinstance(error, LineError):
            self.stop()

    def verify(self) -> np.ndarray:
        """Check that the board is where it was left; return the position.

        Raises
        ------
        UnknownPositionError
            If the position is not known.
        RigError
            If the board restarted or stands elsewhere.
        """
        if self._at is None:
            raise UnknownPositionError(f"the position is not known: {self.why}; home")
        try:
            off = float(np.max(np.abs(self._ask() - self._at)))
        except RigError as error:
            self._lose(error)
            raise
        if off > self.options.tolerance_mm:
            self._lose(f"the position jumped by {off:.3f} mm")
            raise StrayError(f"the position jumped by {off:.3f} mm on its own; home it")
        return self._at

    def position(self) -> np.ndarray | None:
        """Ask where it is; None while that is not known."""
        try:
            return self.verify()
        except RigError:
            return None

    def seconds(self, start: np.ndarray, end: np.ndarray) -> float:
        """Estimate the time of a move in seconds, settling included."""
        distance = float(np.linalg.norm(np.asarray(end) - np.asarray(start)))
        o = self.options
        speed = o.feed_mm_per_min / 60.0
        moving = travel_time(distance, speed, o.acceleration_mm_per_s2)
        return moving + o.settle_s if distance else 0.0

    def confirm(self) -> np.ndarray:
        """Return NaN: it has no means to find lost steps."""
        self.verify()
        return np.full(len(self.axes), np.nan)

    def quieten(self) -> None:
        """Check the position and send the quiet lines."""
        self.verify()
        for text in self.options.quiet:
            self.command(text)

    def unquieten(self) -> None:
        """Send the loud lines and check that nothing moved or restarted."""
        for text in self.options.loud:
            self.command(text)
        self.verify()

    def stop(self) -> None:
        """Stop with M410; Marlin loses its position by that."""
        if self.state not in (State.MOVING, State.FAULT):
            return
        self._lose("it was stopped in mid-move")
        self.state = State.STOPPED
        self.line.write(b"M410\n")

    def close(self) -> None:
        """Close the line."""
        self.line.finish()
        self.state = State.DISCONNECTED
        self._lose("the line was closed")

    def describe(self) -> dict[str, Any]:
        """Return plain facts for the record."""
        return {
            "firmware": self.firmware,
            "state": str(self.state),
            "known": self.known,
            "low_mm": list(self.options.low_mm),
            "high_mm": list(self.options.high_mm),
        }


def _about_numbering(text: str) -> bool:
    """Tell whether an error only leads to a line being asked for again."""
    return any(word in text.lower() for word in ("line", "checksum"))
