"""What a Grbl board holds: memory, counters, motion under way, modes of the parser."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from rigs.firmware.motion import Glide

INCH_MM = 25.4  # by definition
BLOCKS = 15  # BLOCK_BUFFER_SIZE 16 of Grbl 1.1, one of which is always empty


@dataclass
class Modes:
    """What G-code lines leave set, as ``$G`` reports it."""

    motion: str = "G0"
    plane: str = "G17"
    units: str = "G21"
    distance: str = "G90"
    feed_mode: str = "G94"
    system: str = "G54"
    tool: int = 0
    feed: float = 0.0


def _offsets() -> dict[str, np.ndarray]:
    return {f"G{n}": np.zeros(3) for n in (54, 55, 56, 57, 58, 59, 28, 30)}


@dataclass
class BoardState:
    """Everything a board knows and does at a moment; lengths in mm.

    Attributes
    ----------
    settings, startup, offsets
        EEPROM: ``$`` settings, start-up lines, coordinate offsets.
    slipped
        True minus counted position.
    name, substate
        The machine state of the status reports.
    rest
        Counted position while nothing moves.
    planned
        Where the last queued move ends.
    queue, glide
        Moves waiting (target, feed, whether a jog), and the one under way.
    waiting
        Called once all motion has ended; lines wait meanwhile.
    held
        The move a hold interrupted, and whether it is a jog.
    ring, reading
        Bytes received but not read, and whether the main loop is about to.
    locked, blocked
        Silent until a reset; not reading lines for now.
    homing_line, swallowed
        Whether ``$H`` is still to be answered; whether a line never was.
    """

    settings: dict[int, float]
    startup: list[str]
    slipped: np.ndarray
    offsets: dict[str, np.ndarray] = field(default_factory=_offsets)
    name: str = "Idle"
    rest: np.ndarray = field(default_factory=lambda: np.zeros(3))
    ring: deque[int] = field(default_factory=deque)
    swallowed: bool = False
    queue: deque[tuple[np.ndarray, float, bool]] = field(init=False)
    glide: Glide | None = field(init=False)
    waiting: Callable[[], None] | None = field(init=False)
    held: tuple[Glide, bool] | None = field(init=False)
    substate: int = field(init=False)
    locked: bool = field(init=False)
    blocked: bool = field(init=False)
    reading: bool = field(init=False)
    homing_line: bool = field(init=False)
    planned: np.ndarray = field(init=False)
    modes: Modes = field(init=False)
    g92: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Forget motion, queue and modes, as any reset does."""
        self.queue, self.glide = deque(), None
        self.waiting = self.held = None
        self.substate = 0
        self.locked = self.blocked = self.reading = self.homing_line = False
        self.planned = self.rest.copy()
        self.modes, self.g92 = Modes(), np.zeros(3)

    def axes(self, first: int) -> np.ndarray:
        """Return the settings of the three axes from a number on."""
        return np.array([self.settings[first + k] for k in range(3)])

    def stepped(self, place: np.ndarray) -> np.ndarray:
        """Return a place in whole steps."""
        steps = self.axes(100)
        return np.rint(place * steps) / steps

    def position(self, now: float) -> np.ndarray:
        """Return the counted position at a time, in whole steps."""
        return self.stepped(self.glide.position(now) if self.glide else self.rest)

    def work_offset(self) -> np.ndarray:
        """Return machine minus work coordinates."""
        return self.offsets[self.modes.system] + self.g92
