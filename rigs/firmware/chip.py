"""A microcontroller on a serial line: bytes in, bytes out, and things in time."""

import heapq
import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import partial

import numpy as np

BYTE_TIME = 10 / 115200  # s: start, 8 bits and stop at the 115200 baud of Grbl 1.1


class Chip(ABC):
    """Run scheduled actions in simulated time and exchange bytes.

    Nothing happens but in `advance`; `receive` only puts the bytes on their way.
    Faults of the line are switched on by `garble`, `mute`, `delay`, `deafen` and
    `unplug`.

    Parameters
    ----------
    rng
        Draws which bytes are garbled, and into what.
    """

    def __init__(self, rng: np.random.Generator | None = None) -> None:
        self.now = 0.0
        self.rng = rng or np.random.default_rng(0)
        self.heard = bytearray()
        """Every byte that arrived, for tests."""
        self._agenda: list[tuple[float, int, int | None, Callable[[], None]]] = []
        self._order = 0
        self._epoch = 0
        self._ready = bytearray()
        self._busy_until = -math.inf
        self._garble = 0
        self._deaf = 0
        self._lag = 0.0
        self._mute_until = -math.inf
        self._plugged_from = -math.inf

    def schedule(
        self, delay: float, action: Callable[[], None], *, lasting: bool = False
    ) -> None:
        """Do something `delay` seconds from now; a reset forgets it unless lasting."""
        self._order += 1
        epoch = None if lasting else self._epoch
        heapq.heappush(self._agenda, (self.now + delay, self._order, epoch, action))

    def forget(self) -> None:
        """Drop everything scheduled that does not last."""
        self._epoch += 1

    def next_event(self) -> float:
        """Return the time of the next scheduled action, infinity if there is none."""
        while self._agenda and self._agenda[0][2] not in (None, self._epoch):
            heapq.heappop(self._agenda)
        return self._agenda[0][0] if self._agenda else math.inf

    def advance(self, now: float) -> None:
        """Let everything up to the time `now` happen."""
        while (time := self.next_event()) <= now:
            action = heapq.heappop(self._agenda)[3]
            self.now = max(self.now, time)
            action()
        self.now = max(self.now, now)

    def receive(self, data: bytes) -> None:
        """Put bytes on their way to the chip, one byte time apart."""
        self._busy_until = max(self._busy_until, self.now)
        for byte in data:
            arrive = partial(self._arrive, byte)
            self.schedule(self._busy_until - self.now, arrive, lasting=True)
            self._busy_until += BYTE_TIME

    def _arrive(self, byte: int) -> None:
        if self._deaf > 0:
            self._deaf -= 1
            return
        self.heard.append(byte)
        self.hear(byte)

    @abstractmethod
    def hear(self, byte: int) -> None:
        """React to one byte."""

    @abstractmethod
    def power_cycle(self) -> None:
        """Lose the supply for a moment."""

    @property
    @abstractmethod
    def true_position(self) -> np.ndarray:
        """Where the axes really stand, mm and degrees."""

    def send(self, text: str) -> None:
        """Put text on the line, through whatever is wrong with the line."""
        data = bytearray(text.encode("latin-1"))
        if self.now < self._mute_until:
            return
        while self._garble > 0 and data:
            self._garble -= 1
            data[self.rng.integers(len(data))] = self.rng.integers(33, 127)
        if self._lag > 0.0:
            self.schedule(self._lag, lambda: self._ready.extend(data), lasting=True)
        else:
            self._ready.extend(data)

    def take(self) -> bytes:
        """Return the bytes sent since the last call."""
        data = bytes(self._ready)
        self._ready.clear()
        return data

    @property
    def plugged(self) -> bool:
        """Whether the line is connected."""
        return self.now >= self._plugged_from

    def garble(self, replies: int = 1) -> None:
        """Damage one byte in each of the next replies."""
        self._garble += replies

    def mute(self, seconds: float) -> None:
        """Drop everything sent for some seconds."""
        self._mute_until = self.now + seconds

    def delay(self, seconds: float) -> None:
        """Deliver everything sent from now on later by some seconds."""
        self._lag = seconds

    def deafen(self, n_bytes: int) -> None:
        """Lose the next bytes received."""
        self._deaf += n_bytes

    def unplug(self, seconds: float) -> None:
        """Disconnect the line for some seconds; the chip keeps its power."""
        self._plugged_from = self.now + seconds
        self._ready.clear()

    def babble(self, n_bytes: int = 20) -> None:
        """Put random bytes on the line."""
        noise = self.rng.integers(1, 255, n_bytes, dtype=np.uint8)
        self._ready.extend(noise.tobytes())
