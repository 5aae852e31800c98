"""Grbl 1.1h as a model: byte for byte its dialogue, and its motion in time.

Behaviour as recorded from the real firmware; timing that depends on the load of a PC
(homing, the moment a hold takes effect) is only typical.
"""

from collections.abc import Mapping

import numpy as np

from rigs.firmware.grbl.board import Board
from rigs.firmware.grbl.commands import LineCommands
from rigs.firmware.grbl.report import Reports
from rigs.firmware.grbl.settings import DEFAULTS
from rigs.firmware.grbl.state import BoardState

RING = 127  # RX_BUFFER_SIZE 128 of Grbl 1.1, one place of it always empty
LINE_LENGTH = 80  # LINE_BUFFER_SIZE of Grbl 1.1
RESET = 0x18  # Ctrl-X, CMD_RESET of Grbl 1.1
# Typical times in s: long against a byte (0.09 ms) and short against a driver's
# time-outs, so that all orders of events occur; real boards vary with their load.
PARSE_TIME = 0.0015
HOLD_LATENCY = 0.04
BOOT_TIME = 0.1


class GrblFirmware(Board):
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
        memory = dict(DEFAULTS) | dict(settings or {})
        state = BoardState(memory, list(startup), slipped=np.array(at, dtype=float))
        super().__init__(state, rng)
        self.line = bytearray()
        self.reports = Reports(self)
        self.commands = LineCommands(self, self.reports)
        self._power_up()

    # -- power and reset -----------------------------------------------------------

    def _power_up(self) -> None:
        self.state.rest = np.zeros(3)
        self.state.name = "Alarm" if self.state.settings[22] else "Idle"
        self.clear()

    def clear(self) -> None:
        """Forget motion, queue and modes, as any reset does."""
        self.forget()
        self.state.clear()
        self.overlong = False
        self.line.clear()
        self.reports.reset()

    def power_cycle(self) -> None:
        """Lose the supply: motion stops dead, counters and modes are forgotten."""
        true = self.true_position
        self.state.ring.clear()
        self._power_up()
        self.state.slipped = true
        self.state.blocked = True
        self.schedule(BOOT_TIME, self._boot)

    def _boot(self) -> None:
        self.state.blocked = False
        self.greet()

    def greet(self) -> None:
        """Print the banner and what follows it."""
        self.send(self.banner)
        if self.state.settings[21] and self.reports.pins():
            self.state.name = "Alarm"
            self.send("[MSG:Check Limits]\r\n")
        if self.state.name in ("Alarm", "Sleep"):
            self.state.name = "Alarm"
            self.send("[MSG:'$H'|'$X' to unlock]\r\n")
            return
        self.state.name = "Idle"
        self.run_startup()

    def run_startup(self) -> None:
        """Run the start-up lines, as after a reset or homing."""
        for line in self.state.startup:
            if line:
                self.commands.gcode(line)
                self.send(f">{line}:ok\r\n")

    def soft_reset(self) -> None:
        """Do what 0x18 does."""
        here = self.position
        moving = self.state.glide is not None and self.state.name != "Home"
        homing = self.state.name == "Home"
        swallowed = self.state.locked
        if not self.state.locked and homing:
            self.send("ALARM:6\r\n")
        elif not self.state.locked and moving:
            self.send("ALARM:3\r\n")
        self.state.rest = here
        self.state.ring.clear()
        state = "Alarm" if (moving or homing or self.state.locked) else self.state.name
        stray = homing and self.state.homing_line
        self.clear()
        self.state.name = state
        if (swallowed and self.state.swallowed) or stray:
            self.send("ok\r\n")
        self.state.swallowed = False
        self.greet()

    # -- bytes ------------------------------------------------------------------------

    def hear(self, byte: int) -> None:
        """Act on a real-time byte at once, queue any other."""
        if byte == RESET:
            self.schedule(PARSE_TIME, self.soft_reset)
            return
        if self.state.locked or (self.state.blocked and byte == ord("?")):
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
            if self.state.name == "Jog":
                self.schedule(HOLD_LATENCY, self._cancel_jog)
        elif byte >= 0x80:
            self.reports.override(byte)
        elif len(self.state.ring) < RING:
            self.state.ring.append(byte)
            self.wake()

    def wake(self) -> None:
        """Let the main loop look at the received bytes soon."""
        if not self.state.reading:
            self.state.reading = True
            self.schedule(PARSE_TIME, self._work)

    @property
    def stalled(self) -> bool:
        """Whether the main loop is not reading lines."""
        return (
            self.state.blocked
            or self.state.locked
            or self.state.waiting is not None
            or self.state.name in ("Hold", "Door", "Sleep")
            or (self.state.name == "Home" and self.state.homing_line)
        )

    def _work(self) -> None:
        self.state.reading = False
        while self.state.ring and not self.stalled:
            byte = self.state.ring.popleft()
            if byte in b"\r\n":
                line, self.line = self.line.decode("latin-1"), bytearray()
                long, self.overlong = self.overlong, False
                self.commands.line(line, overlong=long)
                if self.state.ring:
                    self.wake()
                return
            if len(self.line) >= LINE_LENGTH - 1:
                self.overlong = True
            elif byte not in b" ":
                self.line.append(byte)

    # -- hold, door, jog cancel -----------------------------------------------------

    def _hold(self) -> None:
        if self.state.name == "Jog":
            self._cancel_jog()
        elif self.state.name in ("Idle", "Run"):
            self.state.name, self.state.substate = "Hold", 1 if self.state.glide else 0
            self.brake(self._still)

    def _still(self) -> None:
        self.state.substate = 0
        if self.state.name == "Door":
            self.reports.overrides_due = 0

    def _door(self) -> None:
        self.send("[MSG:Check Door]\r\n")
        if self.state.name in ("Idle", "Run", "Jog", "Hold"):
            self.state.name, self.state.substate = "Door", 2 if self.state.glide else 0
            self.brake(self._still)

    def _resume(self) -> None:
        if self.state.name not in ("Hold", "Door") or self.state.substate:
            return
        self.state.name = "Idle"
        if self.state.held is not None:
            glide, jog = self.state.held
            self.state.held = None
            self.state.queue.appendleft((glide.end, glide.speed * 60.0, jog))
        if self.state.queue:
            self.start_next()
        self.wake()

    def _cancel_jog(self) -> None:
        if self.state.name != "Jog":
            return
        self.state.queue.clear()

        def done() -> None:
            self.state.held = None
            self.finish()

        self.brake(done)
