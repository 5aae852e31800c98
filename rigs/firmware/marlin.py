"""A Marlin board as a model: numbered lines, checksums, busy, M400."""

from collections.abc import Callable

import numpy as np

from rigs.firmware.chip import Chip
from rigs.firmware.motion import Glide

PARSE_TIME = 0.002  # s, as for Grbl: long against a byte, short against time-outs
BUSY_EVERY = 2.0  # s, DEFAULT_KEEPALIVE_INTERVAL of Marlin 2.1


class MarlinFirmware(Chip):
    """Behave like a Marlin board with three axes homing to 0.

    Parameters
    ----------
    at
        True position at power-up, mm from the switches.
    limits
        Largest position of each axis, mm.
    acceleration, fastest
        mm/s² and mm/s.
    """

    def __init__(
        self,
        at: tuple[float, float, float] = (50.0, 50.0, 50.0),
        limits: tuple[float, float, float] = (200.0, 200.0, 200.0),
        *,
        acceleration: float = 200.0,
        fastest: float = 200.0,
        rng: np.random.Generator | None = None,
    ) -> None:
        super().__init__(rng)
        self.limits = np.array(limits)
        self.acceleration, self.fastest = acceleration, fastest
        self.moves_started = 0
        self.on_move: list[Callable[[int], None]] = []
        self.slipped = np.array(at, dtype=float)
        self._power_up()

    def _power_up(self) -> None:
        self.forget()
        self.line = bytearray()
        self.lines: list[str] = []
        self.last = 0
        self.rest = np.zeros(3)
        self.planned = np.zeros(3)
        self.glide: Glide | None = None
        self.queue: list[tuple[np.ndarray, float]] = []
        self.busy = False
        self.killed = False
        self.relative = False
        self.feed = 1500.0

    def power_cycle(self) -> None:
        """Lose the supply for a moment."""
        true = self.true_position
        self._power_up()
        self.slipped = true
        self.schedule(0.2, lambda: self.send("start\necho:Marlin 2.1\n"))

    @property
    def true_position(self) -> np.ndarray:
        """Where the carriage is, mm from the switches."""
        here = self.glide.position(self.now) if self.glide else self.rest
        return here + self.slipped

    def slip(self, millimetres: np.ndarray) -> None:
        """Lose steps."""
        self.slipped = self.slipped + np.asarray(millimetres, dtype=float)

    def hear(self, byte: int) -> None:
        """Collect lines; M410 and M112 act at once, as with the emergency parser."""
        if byte not in b"\r\n":
            self.line.append(byte)
            return
        text, self.line = self.line.decode("latin-1").strip(), bytearray()
        if not text or self.killed:
            return
        if text.startswith("M410"):
            self._quickstop()
        elif text.startswith("M112"):
            self.killed = True
            self.send("echo:EMERGENCY SHUTDOWN DETECTED. KILLED.\n")
        else:
            self.lines.append(text)
            self._wake()

    def _wake(self) -> None:
        if self.lines and not self.busy:
            self.busy = True
            self.schedule(PARSE_TIME, self._work)

    def _work(self) -> None:
        text = self.lines.pop(0)
        if "M110" in text:
            self.last = int(text.partition("*")[0].rpartition("N")[2])
            text = "M110"
        elif text.startswith("N"):
            checked = self._check(text)
            if checked is None:
                self.send(f"Resend:{self.last + 1}\n")
                self._done()
                return
            text = checked
        self._run(text)

    def _check(self, text: str) -> str | None:
        """Return the command of a numbered line, None if it must be sent again."""
        body, star, total = text.partition("*")
        check = 0
        for byte in body.encode("latin-1"):
            check ^= byte
        number, _, command = body[1:].partition(" ")
        if not number.isdigit() or int(number) != self.last + 1:
            self.send(f"Error: expected line {self.last + 1} got {number}\n")
            return None
        if not star or not total.isdigit() or int(total) != check:
            self.send("Error: Missing checksum\n")
            return None
        self.last += 1
        return command

    def _done(self, text: str = "ok") -> None:
        self.busy = False
        self.send(text + "\n")
        self._wake()

    def _run(self, command: str) -> None:
        words = command.split()
        code = words[0] if words else ""
        values = {w[0]: float(w[1:]) for w in words[1:] if len(w) > 1}
        if code in ("G0", "G1"):
            self._plan(values)
            self._done()
        elif code == "G28":
            self._home()
        elif code == "M400":
            self._barrier(self._done)
        elif code == "G4":
            seconds = values.get("S", 0.0) + values.get("P", 0.0) / 1000.0
            self._barrier(lambda: self._wait(seconds))
        elif code in ("G90", "G91"):
            self.relative = code == "G91"
            self._done()
        elif code == "M114":
            self._done(self._place())
        elif code == "M115":
            self.send("FIRMWARE_NAME:Virtual Marlin 1.0 PROTOCOL_VERSION:1.0\n")
            self._done()
        else:
            self._done()

    def _place(self) -> str:
        x, y, z = self.planned
        return f"ok X:{x:.2f} Y:{y:.2f} Z:{z:.2f} E:0.00 Count X:0 Y:0 Z:0"

    def _plan(self, values: dict[str, float]) -> None:
        target = self.planned.copy()
        for k, letter in enumerate("XYZ"):
            if letter in values:
                base = self.planned[k] if self.relative else 0.0
                target[k] = base + values[letter]
        self.feed = values.get("F", self.feed)
        target = np.clip(target, 0.0, self.limits)
        if np.any(target != self.planned):
            self.queue.append((target, self.feed))
            self.planned = target
            if self.glide is None:
                self._start()

    def _start(self) -> None:
        if not self.queue:
            return
        target, feed = self.queue.pop(0)
        speed = min(feed / 60.0, self.fastest)
        self.glide = Glide(self.rest, target, speed, self.acceleration, self.now)
        self.schedule(self.glide.end_time - self.now, self._arrived)
        self.moves_started += 1
        for listener in self.on_move:
            listener(self.moves_started)

    def _arrived(self) -> None:
        if self.glide is not None:
            self.rest = self.glide.end.copy()
            self.glide = None
        self._start()

    def _barrier(self, then: Callable[[], None], waited: float = 0.0) -> None:
        if self.glide is None and not self.queue:
            then()
            return
        if waited >= BUSY_EVERY:
            self.send("echo:busy: processing\n")
            waited = 0.0
        self.schedule(0.05, lambda: self._barrier(then, waited + 0.05))

    def _wait(self, seconds: float) -> None:
        if seconds > BUSY_EVERY:
            self.schedule(BUSY_EVERY, lambda: self.send("busy:processing\n"))
            self.schedule(BUSY_EVERY, lambda: self._wait(seconds - BUSY_EVERY))
        else:
            self.schedule(seconds, self._done)

    def _home(self) -> None:
        def homed() -> None:
            self.rest = np.zeros(3)
            self.planned = np.zeros(3)
            self.slipped = np.zeros(3)
            self._done()

        seconds = float(np.sum(np.abs(self.true_position))) / 50.0 + 1.0
        self._barrier(lambda: self._wait_then(seconds, homed))

    def _wait_then(self, seconds: float, then: Callable[[], None]) -> None:
        if seconds > BUSY_EVERY:
            self.send("echo:busy: processing\n")
            self.schedule(BUSY_EVERY, lambda: self._wait_then(seconds - 2.0, then))
        else:
            self.schedule(seconds, then)

    def _quickstop(self) -> None:
        self.rest = self.glide.position(self.now) if self.glide else self.rest
        self.forget()
        self.glide = None
        self.queue.clear()
        self.planned = self.rest.copy()
        self.busy = False
        self.send("ok\n")
