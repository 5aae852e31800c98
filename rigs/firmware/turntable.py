"""A home-built turntable as a model: one-letter commands, a caret when done."""

import numpy as np

from rigs.firmware.chip import Chip
from rigs.firmware.motion import Glide

PARSE_TIME = 0.005  # s: some bytes at the 9600 baud of such boxes


class TurntableFirmware(Chip):
    """Understand ``A90`` (go to 90°), ``H`` (home), ``P`` (position), ``S`` (stop).

    Parameters
    ----------
    at
        True angle at power-up, degrees.
    speed, acceleration
        Degrees per second and per second squared.
    silent
        Whether it never answers anything, like an open-loop pulse box.
    """

    def __init__(
        self,
        at: float = 30.0,
        *,
        speed: float = 10.0,
        acceleration: float = 20.0,
        silent: bool = False,
        rng: np.random.Generator | None = None,
    ) -> None:
        super().__init__(rng)
        self.speed, self.acceleration, self.silent = speed, acceleration, silent
        self.offset = at
        self.rest = np.zeros(1)
        self.glide: Glide | None = None
        self.line = bytearray()

    @property
    def true_position(self) -> np.ndarray:
        """The true angle, degrees, shape (1,)."""
        here = self.glide.position(self.now) if self.glide else self.rest
        return here + self.offset

    def power_cycle(self) -> None:
        """Lose the supply for a moment; it calls the place where it stands zero."""
        self.offset = float(self.true_position[0])
        self.rest = np.zeros(1)
        self.glide = None
        self.forget()
        self._say("READY")

    def _say(self, text: str) -> None:
        if not self.silent:
            self.send(text + "\r\n")

    def hear(self, byte: int) -> None:
        """Collect a line and run it."""
        if byte in b"\r\n":
            text, self.line = self.line.decode("latin-1"), bytearray()
            if text:
                self.schedule(PARSE_TIME, lambda: self._run(text), lasting=True)
        else:
            self.line.append(byte)

    def _run(self, text: str) -> None:
        if text == "P":
            here = self.glide.position(self.now) if self.glide else self.rest
            self._say(f"P{here[0]:.2f}")
        elif text == "S":
            self.rest = self.glide.position(self.now) if self.glide else self.rest
            self.glide = None
            self.forget()
            self._say("OK")
        elif text == "H":
            self.rest, self.offset = self.true_position, 0.0
            self._go(0.0)
        elif text.startswith("A"):
            try:
                self._go(float(text[1:]))
            except ValueError:
                self._say("?")
        else:
            self._say("?")

    def _go(self, target: float) -> None:
        self._say("OK")
        end = np.array([target])
        self.glide = Glide(self.rest, end, self.speed, self.acceleration, self.now)
        self.schedule(self.glide.end_time - self.now, self._arrived)

    def _arrived(self) -> None:
        if self.glide is not None:
            self.rest = self.glide.end.copy()
            self.glide = None
        self._say("^")
