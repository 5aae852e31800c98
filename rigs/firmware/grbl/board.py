"""How a Grbl board moves in time: queue, straight moves, braking, alarms."""

from abc import abstractmethod
from collections.abc import Callable

import numpy as np

from rigs.firmware.chip import Chip
from rigs.firmware.grbl.state import BoardState
from rigs.firmware.motion import Glide

START_DELAY = 0.002
"""From a line taken to the first step, s; in recorded dialogues a line is answered
before its motion shows."""
ALARM_TEXT_DELAY = 0.5
"""s: report_alarm_message of Grbl 1.1 waits so long before anything else is sent."""
SWITCH_LOOKS = 400
"""Places of a move looked at for a pressed switch: every 5 mm of 2 m, and a hard limit
may overrun by that."""


class Board(Chip):
    """Move by what the state says; what reads lines and answers builds on it.

    Parameters
    ----------
    state
        What the board holds.
    rng
        Draws line faults.
    """

    def __init__(self, state: BoardState, rng: np.random.Generator | None) -> None:
        super().__init__(rng)
        self.state = state
        self.moves_started = 0
        self.on_move: list[Callable[[int], None]] = []
        """Called with the number of each move, jogs aside, as it starts; for faults."""

    @abstractmethod
    def clear(self) -> None:
        """Forget motion, queue and modes, as any reset does."""

    @abstractmethod
    def greet(self) -> None:
        """Print the banner and what follows it."""

    @abstractmethod
    def soft_reset(self) -> None:
        """Do what 0x18 does."""

    @abstractmethod
    def run_startup(self) -> None:
        """Run the start-up lines, as after a reset or homing."""

    @abstractmethod
    def wake(self) -> None:
        """Let the main loop look at the received bytes soon."""

    def answer(self, code: int = 0) -> None:
        """End a line with ok or an error."""
        self.send(f"error:{code}\r\n" if code else "ok\r\n")

    @property
    def position(self) -> np.ndarray:
        """Counted position, mm, in whole steps."""
        return self.state.position(self.now)

    @property
    def true_position(self) -> np.ndarray:
        """Where the carriage really is, mm from the switches."""
        return self.position + self.state.slipped

    def slip(self, millimetres: np.ndarray) -> None:
        """Lose steps: the carriage is elsewhere and the counter does not know."""
        self.state.slipped = self.state.slipped + np.asarray(millimetres, dtype=float)

    # -- motion -----------------------------------------------------------------------

    def plan(self, target: np.ndarray, feed: float, *, jog: bool = False) -> None:
        """Queue a straight move; feed in mm/min, infinite for a rapid."""
        state = self.state
        state.queue.append((target, feed, jog))
        state.planned = target
        if state.glide is None and state.name in ("Idle", "Jog", "Run"):
            self.schedule(START_DELAY, self.start_next)

    def start_next(self) -> None:
        """Start the next move of the queue, unless something moves or forbids it."""
        state = self.state
        if state.glide is not None or state.name in ("Hold", "Door", "Alarm"):
            return
        if not state.queue:
            self.finish()
            return
        target, feed, jog = state.queue.popleft()
        if state.name != "Home":
            state.name = "Jog" if jog else "Run"
        state.glide = self._glide(target, feed)
        self.schedule(self._crossing(state.glide) - self.now, self._arrive_block)
        if not jog:
            self.moves_started += 1
            for listener in self.on_move:
                listener(self.moves_started)

    def _glide(self, target: np.ndarray, feed: float) -> Glide:
        here = self.state.rest
        way = np.abs(target - here)
        length = float(np.linalg.norm(way))
        share = np.maximum(way / length, 1e-12) if length else np.ones(3)
        speed = min(feed, float(np.min(self.state.axes(110) / share))) / 60.0
        ramp = float(np.min(self.state.axes(120) / share))
        return Glide(here, target, speed, ramp, begin=self.now)

    def _crossing(self, glide: Glide) -> float:
        """Return when the move ends, earlier if it runs onto a switch."""
        if not self.state.settings[21] or self.state.name == "Home":
            return glide.end_time
        onward = glide.end > glide.start
        for time in np.linspace(glide.begin, glide.end_time, SWITCH_LOOKS):
            pressed = glide.position(float(time)) + self.state.slipped > -1e-9
            if np.any(pressed & onward):
                return float(time)
        return glide.end_time

    def _arrive_block(self) -> None:
        state = self.state
        if state.glide is None:
            return
        early = self.now < state.glide.end_time - 1e-9
        state.rest = (
            np.minimum(self.position, -state.slipped)
            if early
            else state.glide.position(self.now)
        )
        state.glide = None
        if early:
            self.alarm(1, critical=True)
        elif state.queue:
            self.start_next()
        else:
            self.finish()

    def finish(self) -> None:
        """Come to rest, and do what waited for it."""
        state = self.state
        if state.name in ("Run", "Jog"):
            state.name = "Idle"
        state.planned = state.rest.copy()
        if state.waiting is not None:
            done, state.waiting = state.waiting, None
            done()
        self.wake()

    def when_still(self, action: Callable[[], None]) -> None:
        """Do something once all motion has ended; lines wait meanwhile."""
        if self.state.glide is None and not self.state.queue:
            action()
        else:
            self.state.waiting = action

    def brake(self, done: Callable[[], None]) -> None:
        """Slow down to rest along the way, then do something."""
        state, glide = self.state, self.state.glide
        if glide is None:
            done()
            return
        self._forget_motion()
        slowing = glide.braked(self.now)
        state.held = (glide, state.name == "Jog")
        state.glide = slowing

        def stand() -> None:
            state.rest = state.stepped(slowing.end)
            state.glide = None
            done()

        self.schedule(slowing.end_time - self.now, stand)

    def _forget_motion(self) -> None:
        """Cancel scheduled ends of moves."""
        self.forget()
        self.state.reading = False
        if self.state.ring:
            self.wake()

    def alarm(self, number: int, *, critical: bool = False) -> None:
        """Raise an alarm; a critical one silences the board until it is reset."""
        state = self.state
        self.send(f"ALARM:{number}\r\n")
        state.rest = self.position
        state.glide = state.waiting = None
        state.queue.clear()
        self.forget()
        state.reading = False
        state.name = "Alarm"
        if critical:
            state.locked = True
            self.schedule(
                ALARM_TEXT_DELAY, lambda: self.send("[MSG:Reset to continue]\r\n")
            )
