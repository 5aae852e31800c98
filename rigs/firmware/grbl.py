"""Grbl 1.1h as a model: byte for byte its dialogue, and its motion in time.

Behaviour as recorded from the real firmware; timing that depends on the load of a PC
(homing, the moment a hold takes effect) is only typical.
"""

from collections import deque
from collections.abc import Callable, Mapping

import numpy as np

from rigs.firmware.chip import Chip
from rigs.firmware.grbl_commands import Commands
from rigs.firmware.grbl_report import Reports
from rigs.firmware.grbl_settings import DEFAULTS
from rigs.firmware.motion import Glide

RING = 127
LINE_LENGTH = 80
PARSE_TIME = 0.0015
START_DELAY = 0.002
HOLD_LATENCY = 0.04
BOOT_TIME = 0.1
RESET = 0x18
ALARM_TEXT_DELAY = 0.5


class GrblFirmware(Chip):
    """Behave like a board with Grbl 1.1h and three axes with switches at +.

    Parameters
    ----------
    settings
        EEPROM settings that differ from the defaults, as ``{22: 1}``.
    at
        True position at power-up in mm of the homed machine: the switches are at 0.
    startup
        The two start-up lines.
    rng
        Draws line faults.
    """

    banner = "\r\nGrbl 1.1h ['$' for help]\r\n"

    def __init__(
        self,
        settings: Mapping[int, float] | None = None,
        *,
        at: tuple[float, float, float] = (-100.0, -100.0, -100.0),
        startup: tuple[str, str] = ("", ""),
        rng: np.random.Generator | None = None,
    ) -> None:
        super().__init__(rng)
        self.settings = dict(DEFAULTS) | dict(settings or {})
        self.startup = list(startup)
        self.offsets = {f"G{n}": np.zeros(3) for n in (54, 55, 56, 57, 58, 59, 28, 30)}
        self.slipped = np.array(at, dtype=float)
        """True minus counted position, mm."""
        self.ring: deque[int] = deque()
        self.line = bytearray()
        self.moves_started = 0
        self.on_move: list[Callable[[int], None]] = []
        """Called with the number of each move, jogs aside, as it starts; for faults."""
        self.reports = Reports(self)
        self.commands = Commands(self)
        self._power_up()

    # -- power and reset -----------------------------------------------------------

    def _power_up(self) -> None:
        self.rest = np.zeros(3)
        self.state = "Alarm" if self.settings[22] else "Idle"
        self.clear()

    def clear(self) -> None:
        """Forget motion, queue and modes, as any reset does."""
        self.forget()
        self.queue: deque[tuple[np.ndarray, float, bool]] = deque()
        self.glide: Glide | None = None
        self.waiting: Callable[[], None] | None = None
        self.held: tuple[Glide, bool] | None = None
        self.substate = 0
        self.locked = False
        self.blocked = False
        self.busy = False
        self.overlong = False
        self.line.clear()
        self.planned = self.rest.copy()
        self.commands.reset()
        self.reports.reset()

    def power_cycle(self) -> None:
        """Lose the supply: motion stops dead, counters and modes are forgotten."""
        true = self.true_position
        self.ring.clear()
        self._power_up()
        self.slipped = true
        self.blocked = True
        self.schedule(BOOT_TIME, self._boot)

    def _boot(self) -> None:
        self.blocked = False
        self.greet()

    def greet(self) -> None:
        """Print the banner and what follows it."""
        self.send(self.banner)
        if self.settings[21] and self.reports.pins():
            self.state = "Alarm"
            self.send("[MSG:Check Limits]\r\n")
        if self.state in ("Alarm", "Sleep"):
            self.state = "Alarm"
            self.send("[MSG:'$H'|'$X' to unlock]\r\n")
            return
        self.state = "Idle"
        self.run_startup()

    def run_startup(self) -> None:
        """Run the start-up lines, as after a reset or homing."""
        for line in self.startup:
            if line:
                self.commands.gcode(line)
                self.send(f">{line}:ok\r\n")

    def soft_reset(self) -> None:
        """Do what 0x18 does."""
        here = self.position
        moving = self.glide is not None and self.state != "Home"
        homing = self.state == "Home"
        swallowed = self.locked
        if not self.locked and homing:
            self.send("ALARM:6\r\n")
        elif not self.locked and moving:
            self.send("ALARM:3\r\n")
        self.rest = here
        self.ring.clear()
        state = "Alarm" if (moving or homing or self.locked) else self.state
        stray = homing and self.commands.homing_line
        self.clear()
        self.state = state
        if (swallowed and self.commands.swallowed) or stray:
            self.send("ok\r\n")
        self.commands.swallowed = False
        self.greet()

    # -- where it is ----------------------------------------------------------------

    @property
    def position(self) -> np.ndarray:
        """Counted position, mm, in whole steps."""
        return self.stepped(self.glide.position(self.now) if self.glide else self.rest)

    def stepped(self, place: np.ndarray) -> np.ndarray:
        """Return a place in whole steps, mm."""
        steps = np.array([self.settings[n] for n in (100, 101, 102)])
        return np.rint(place * steps) / steps

    @property
    def true_position(self) -> np.ndarray:
        """Where the carriage really is, mm from the switches."""
        return self.position + self.slipped

    def slip(self, millimetres: np.ndarray) -> None:
        """Lose steps: the carriage is elsewhere and the counter does not know."""
        self.slipped = self.slipped + np.asarray(millimetres, dtype=float)

    # -- bytes ------------------------------------------------------------------------

    def hear(self, byte: int) -> None:
        """Act on a real-time byte at once, queue any other."""
        if byte == RESET:
            self.schedule(PARSE_TIME, self.soft_reset)
            return
        if self.locked or (self.blocked and byte == ord("?")):
            return
        if byte == ord("?"):
            self.reports.ask()
        elif byte == ord("!"):
            self.schedule(HOLD_LATENCY, self._hold)
        elif byte == ord("~"):
            self.schedule(PARSE_TIME, self._resume)
        elif byte == 0x84:
            self.schedule(HOLD_LATENCY / 2, self._door)
        elif byte == 0x85:
            if self.state == "Jog":
                self.schedule(HOLD_LATENCY, self._cancel_jog)
        elif byte >= 0x80:
            self.reports.override(byte)
        elif len(self.ring) < RING:
            self.ring.append(byte)
            self.wake()

    def wake(self) -> None:
        """Let the main loop look at the received bytes soon."""
        if not self.busy:
            self.busy = True
            self.schedule(PARSE_TIME, self._work)

    @property
    def stalled(self) -> bool:
        """Whether the main loop is not reading lines."""
        return (
            self.blocked
            or self.locked
            or self.waiting is not None
            or self.state in ("Hold", "Door", "Sleep")
            or (self.state == "Home" and self.commands.homing_line)
        )

    def _work(self) -> None:
        self.busy = False
        while self.ring and not self.stalled:
            byte = self.ring.popleft()
            if byte in b"\r\n":
                line, self.line = self.line.decode("latin-1"), bytearray()
                long, self.overlong = self.overlong, False
                self.commands.line(line, overlong=long)
                if self.ring:
                    self.wake()
                return
            if len(self.line) >= LINE_LENGTH - 1:
                self.overlong = True
            elif byte not in b" ":
                self.line.append(byte)

    def answer(self, code: int = 0) -> None:
        """End a line with ok or an error."""
        self.send(f"error:{code}\r\n" if code else "ok\r\n")

    # -- motion -----------------------------------------------------------------------

    def plan(self, target: np.ndarray, feed: float, *, jog: bool = False) -> None:
        """Queue a straight move; feed in mm/min, infinite for a rapid."""
        self.queue.append((target, feed, jog))
        self.planned = target
        if self.glide is None and self.state in ("Idle", "Jog", "Run"):
            self.schedule(START_DELAY, self._start_next)

    def _start_next(self) -> None:
        if self.glide is not None or self.state in ("Hold", "Door", "Alarm"):
            return
        if not self.queue:
            self._finish()
            return
        target, feed, jog = self.queue.popleft()
        if self.state != "Home":
            self.state = "Jog" if jog else "Run"
        self._go(self._glide(target, feed))
        if not jog:
            self.moves_started += 1
            for listener in self.on_move:
                listener(self.moves_started)

    def _glide(self, target: np.ndarray, feed: float) -> Glide:
        way = np.abs(target - self.rest)
        length = float(np.linalg.norm(way))
        limits = np.array([self.settings[110 + k] for k in range(3)])
        ramps = np.array([self.settings[120 + k] for k in range(3)])
        share = np.maximum(way / length, 1e-12) if length else np.ones(3)
        speed = min(feed, float(np.min(limits / share))) / 60.0
        return Glide(
            self.rest, target, speed, float(np.min(ramps / share)), begin=self.now
        )

    def _go(self, glide: Glide) -> None:
        self.glide = glide
        end = self._crossing(glide)
        self.schedule(end - self.now, self._arrive_block)

    def _crossing(self, glide: Glide) -> float:
        """Return when the move ends, earlier if it runs onto a switch."""
        if not self.settings[21] or self.state == "Home":
            return glide.end_time
        onward = glide.end > glide.start
        for time in np.linspace(glide.begin, glide.end_time, 400):
            pressed = glide.position(float(time)) + self.slipped > -1e-9
            if np.any(pressed & onward):
                return float(time)
        return glide.end_time

    def _arrive_block(self) -> None:
        if self.glide is None:
            return
        early = self.now < self.glide.end_time - 1e-9
        self.rest = (
            np.minimum(self.position, -self.slipped)
            if early
            else (self.glide.position(self.now))
        )
        self.glide = None
        if early:
            self.alarm(1, critical=True)
            return
        if self.queue:
            self._start_next()
        else:
            self._finish()

    def _finish(self) -> None:
        if self.state in ("Run", "Jog"):
            self.state = "Idle"
        self.planned = self.rest.copy()
        if self.waiting is not None:
            done, self.waiting = self.waiting, None
            done()
        self.wake()

    def when_still(self, action: Callable[[], None]) -> None:
        """Do something once all motion has ended; lines wait meanwhile."""
        if self.glide is None and not self.queue:
            action()
        else:
            self.waiting = action

    # -- hold, door, jog cancel -----------------------------------------------------

    def brake(self, done: Callable[[], None]) -> None:
        """Slow down to rest along the way, then do something."""
        glide = self.glide
        if glide is None:
            done()
            return
        self.forget_motion()
        slowing = glide.braked(self.now)
        self.held = (glide, self.state == "Jog")
        self.glide = slowing

        def rest() -> None:
            self.rest = self.stepped(slowing.end)
            self.glide = None
            done()

        self.schedule(slowing.end_time - self.now, rest)

    def forget_motion(self) -> None:
        """Cancel scheduled ends of moves."""
        self.forget()
        self.busy = False
        if self.ring:
            self.wake()

    def _hold(self) -> None:
        if self.state == "Jog":
            self._cancel_jog()
        elif self.state in ("Idle", "Run"):
            self.state, self.substate = "Hold", 1 if self.glide else 0
            self.brake(self._still)

    def _still(self) -> None:
        self.substate = 0
        if self.state == "Door":
            self.reports.overrides_due = 0

    def _door(self) -> None:
        self.send("[MSG:Check Door]\r\n")
        if self.state in ("Idle", "Run", "Jog", "Hold"):
            self.state, self.substate = "Door", 2 if self.glide else 0
            self.brake(self._still)

    def _resume(self) -> None:
        if self.state not in ("Hold", "Door") or self.substate:
            return
        self.state = "Idle"
        if self.held is not None:
            glide, jog = self.held
            self.held = None
            self.queue.appendleft((glide.end, glide.speed * 60.0, jog))
        if self.queue:
            self._start_next()
        self.wake()

    def _cancel_jog(self) -> None:
        if self.state != "Jog":
            return
        self.queue.clear()

        def done() -> None:
            self.held = None
            self._finish()

        self.brake(done)

    # -- alarms -----------------------------------------------------------------------

    def alarm(self, number: int, *, critical: bool = False) -> None:
        """Raise an alarm; a critical one silences the board until it is reset."""
        self.send(f"ALARM:{number}\r\n")
        self.rest = self.position
        self.glide = None
        self.queue.clear()
        self.waiting = None
        self.forget()
        self.busy = False
        self.state = "Alarm"
        if critical:
            self.locked = True
            self.schedule(
                ALARM_TEXT_DELAY, lambda: self.send("[MSG:Reset to continue]\r\n")
            )
