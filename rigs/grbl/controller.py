"""Grbl 1.1 and grblHAL boards: connect, home, move, arrive, stop."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from rigs.controller import State
from rigs.faults import (
    RefusedError,
    SilenceError,
    StrayError,
)
from rigs.grbl.link import HOLD, JOG_CANCEL, RESUME
from rigs.grbl.parsing import Ok, Refused, Status
from rigs.grbl.state import GrblState
from rigs.motion import travel_time
from rir.errors import OutOfReachError, RigError


class GrblController(GrblState):
    """Drive one board: everything of `GrblState`, and motion."""

    # -- moving -----------------------------------------------------------------------

    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lowest and highest machine position of each axis, mm."""
        return self._board.low, self._board.high

    def home_position(self) -> np.ndarray:
        """Return where each axis stands after homing, mm."""
        return self._board.homed

    def _check(self, points: Sequence[np.ndarray]) -> None:
        low, high = self.limits()
        for point in points:
            beyond = np.maximum(low - point, point - high)
            k = int(np.argmax(beyond))
            if not np.all(np.isfinite(point)) or beyond[k] > 1e-9:
                raise OutOfReachError(
                    f"machine {self.axes[k]} = {point[k]:.3f} is outside the travel "
                    f"of {low[k]:.3f} to {high[k]:.3f} mm; choose a pose inside"
                )

    def move(self, points: Sequence[np.ndarray]) -> np.ndarray:
        """Go past all points to the last, and return the position it came to rest at.

        Arrived means: every line acknowledged, a dwell behind them acknowledged,
        Idle twice, at the target within the tolerance, and settled.

        Raises
        ------
        OutOfReachError
            Before anything moves.
        UnknownPositionError
            If the position is not known.
        RigError
            If it did not get there; it has been stopped.
        """
        self._check(points)
        left = list(points)
        retries = self.options.retries
        while True:
            at = self.verify()
            try:
                return self._go([at, *left])
            except (SilenceError, RefusedError) as error:
                self._halt(error)
                if retries == 0 or not self.known:
                    raise
                retries -= 1
                left = self._remaining([at, *left])
            except BaseException as error:
                self._halt(error)
                raise

    def _remaining(self, path: list[np.ndarray]) -> list[np.ndarray]:
        """Return the points of an interrupted way that are still ahead."""
        at = self._at
        if at is None:
            return path[1:]
        gaps = [_gap(at, a, b) for a, b in pairwise(path)]
        return path[int(np.argmin(gaps)) + 1 :]

    def _go(self, path: list[np.ndarray]) -> np.ndarray:
        self.state = State.MOVING
        lines = [self._move_line(point) for point in path[1:]]
        self.link.stream(lines)
        self.link.send(b"G4 P0.01\n")
        self._await_barrier(path)
        here = self._arrive(path[-1])
        self.clock.sleep(self.options.settle_s)
        self._at = here
        self.state = State.IDLE
        return self.verify()

    def _move_line(self, point: np.ndarray) -> str:
        words = [f"{'XYZ'[k]}{value + 0.0:.3f}" for k, value in enumerate(point)]
        feed = self.options.feed_mm_per_min
        return f"G21 G90 G94 G53 G1 {' '.join(words)} F{feed:g}"

    def _await_barrier(self, path: list[np.ndarray]) -> None:
        """Wait for the dwell's ok, watching that it moves where it should."""
        ways = pairwise(path)
        allowed = 10.0 + 2.0 * sum(self.seconds(a, b) for a, b in ways)
        deadline = self.clock.now() + allowed
        strays = idle = 0
        while self.clock.now() < deadline and idle < 12:
            word = self.link.next(0.2)
            self.link.raise_events(word)
            if isinstance(word, Ok):
                return
            if isinstance(word, Refused):
                raise RefusedError("the board refused the dwell", word.code)
            if isinstance(word, Status):
                strays = strays + 1 if self._strays(word, path) else 0
                idle = idle + 1 if word.state == State.IDLE else 0
                self._judge(word, strays)
            elif word is None:
                self.link.send(b"?")
        raise SilenceError(
            f"the end of the move was not acknowledged within {allowed:.0f} s"
        )

    def _judge(self, status: Status, strays: int) -> None:
        if status.state in (
            State.HOLD,
            State.DOOR,
            State.SLEEP,
            State.ALARM,
            State.CHECK,
        ):
            raise RigError(
                f"the machine went to {status.state} in mid-move; something or "
                "somebody stopped it there"
            )
        if strays >= 2:
            raise StrayError(
                "the machine leaves the straight way to its target; stopped; a line "
                "was probably damaged on its way"
            )

    def _strays(self, status: Status, path: list[np.ndarray]) -> bool:
        here = self.link.machine_position(status)
        if here is None:
            return False
        point = here[: len(self.axes)]
        ways = pairwise(path)
        return min(_gap(point, a, b) for a, b in ways) > self.options.stray_mm

    def _arrive(self, target: np.ndarray) -> np.ndarray:
        status, here = self.link.settled()
        here = here[: len(self.axes)]
        off = float(np.max(np.abs(here - target)))
        if status.state != State.IDLE or off > self.options.tolerance_mm:
            raise StrayError(
                f"the move ended {status.state} at {here.tolist()} mm, {off:.3f} mm "
                f"from its target {np.round(target, 3).tolist()} mm"
            )
        return here

    def seconds(self, start: np.ndarray, end: np.ndarray) -> float:
        """Estimate the time of a move in seconds, settling included."""
        distance = float(np.linalg.norm(np.asarray(end) - np.asarray(start)))
        if distance == 0.0:
            return 0.0
        speed, ramp = self._board.limits_along(np.asarray(end) - np.asarray(start))
        speed = min(speed, self.options.feed_mm_per_min / 60.0)
        return travel_time(distance, speed, ramp) + self.options.settle_s

    def jog(self, step: np.ndarray, feed_mm_per_min: float) -> np.ndarray:
        """Move by a small step as a jog, which can be cancelled, and wait for it."""
        at = self.verify()
        self._check([at + step])
        words = " ".join(f"{'XYZ'[k]}{v + 0.0:.3f}" for k, v in enumerate(step))
        try:
            self.link.command(f"$J=G91 G21 {words} F{feed_mm_per_min:g}")
            self.state = State.MOVING
            self._rested()
            here = self._arrive(at + step)
        except BaseException as error:
            self._halt(error)
            raise
        self._at, self.state = here, State.IDLE
        return here

    def cancel_jog(self) -> np.ndarray | None:
        """Stop a jog where it is; the position stays known."""
        self.link.send(JOG_CANCEL)
        self._rested()
        return self._take_rest()

    def hold(self) -> None:
        """Interrupt a move; `resume` goes on with it."""
        self.link.send(HOLD)
        self._await_state(lambda s: s.state == State.HOLD and s.substate == 0)
        self.state = State.HOLDING

    def resume(self) -> None:
        """Go on with a move that was held."""
        self.link.send(RESUME)
        self._await_state(lambda s: s.state in (State.RUN, State.JOG, State.IDLE))
        self.state = State.MOVING

    def position(self) -> np.ndarray | None:
        """Ask the board where it is; None while that is not known."""
        self._snag = ""
        try:
            return self.verify()
        except RigError as error:
            self._snag = str(error)
            return None

    def confirm(self) -> np.ndarray:
        """Go to the reference switches and compare; return the drift, mm.

        NaN for axes it cannot tell: no ``reference`` in the rig file, hard limits
        switched on, or switches that do not close within the travel.

        Raises
        ------
        StrayError
            If steps were lost; the position is unknown then.
        """
        at = self.verify()
        if self.reference is None:
            return np.full(len(self.axes), np.nan)
        self.state = State.MOVING
        try:
            drift = self.reference.drift()
            if np.nanmax(np.abs(drift), initial=0.0) > self.options.reference_mm:
                raise StrayError(
                    f"steps were lost: the machine is {np.round(drift, 2).tolist()} mm "
                    "from where it counts; home it and repeat what was measured since"
                )
            here = self.link.settled()[1][: len(at)]
        except BaseException as error:
            self._halt(error)
            if isinstance(error, StrayError):
                self._lose(error)
            raise
        self._at, self.state = here, State.IDLE
        return drift

    def quieten(self) -> None:
        """Check the position and send the quiet lines of the rig file."""
        self.verify()
        for text in self.options.quiet:
            self.link.command(text)

    def unquieten(self) -> None:
        """Send the loud lines and check that nothing moved or restarted."""
        for text in self.options.loud:
            self.link.command(text)
        self.verify()

    def close(self) -> None:
        """Close the line; the machine stays as it is."""
        self.link.line.finish()
        self.state = State.DISCONNECTED
        self._lose("the line was closed")

    def describe(self) -> dict[str, Any]:
        """Return firmware, settings and states for the record."""
        facts = self.board.describe() if self.board else {}
        return facts | {
            "state": str(self.state),
            "known": self.known,
            "reboots_seen": self.link.reboots,
            "damaged_lines": self.link.noise,
            "homings": self.homings,
            "alarms": self.alarms,
            "settle_s": self.options.settle_s,
            "quiet": list(self.options.quiet),
        }


def _gap(point: np.ndarray, start: np.ndarray, end: np.ndarray) -> float:
    """Return the distance of a point to a straight way."""
    way = end - start
    length = float(way @ way)
    share = float(np.clip((point - start) @ way / length, 0, 1)) if length else 0.0
    return float(np.linalg.norm(point - start - share * way))
