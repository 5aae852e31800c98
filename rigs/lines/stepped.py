"""Pseudo-terminals in simulated time: pyserial is exercised, nothing ever waits.

Time passes only while the driver waits, and only after all bytes on the way have
arrived, so a loaded computer cannot make a time-out expire.
"""

import fcntl
import os
import select
import struct
import termios
import tty

from rigs.clock import VirtualClock
from rigs.faults import LineError
from rigs.firmware.chip import Chip

TRANSIT = 5.0
"""Real seconds the kernel may take to hand bytes from one end to the other."""


def _waiting(descriptor: int) -> int:
    answer = fcntl.ioctl(descriptor, termios.FIONREAD, struct.pack("i", 0))
    return struct.unpack("i", answer)[0]


class SteppedTerminal:
    """A pseudo-terminal with a chip behind it, served from within the clock."""

    def __init__(self, chip: Chip) -> None:
        self.chip = chip
        self._main, self._far = os.openpty()
        tty.setraw(self._main)
        tty.setraw(self._far)
        self.port = os.ttyname(self._far)
        self._expected = 0

    def sent(self, count: int) -> None:
        """Learn that the driver has written some bytes."""
        self._expected += count

    def pump(self, now: float) -> None:
        """Bring the chip up to the time and carry bytes both ways."""
        while self._expected:
            readable, _, _ = select.select([self._main], [], [], TRANSIT)
            if not readable:
                raise LineError("the pseudo-terminal lost bytes; is the system well?")
            data = os.read(self._main, 4096)
            self._expected -= len(data)
            if self.chip.plugged:
                self.chip.receive(data)
        self.chip.advance(now)
        if answer := self.chip.take():
            self._deliver(answer)

    def _deliver(self, answer: bytes) -> None:
        wanted = _waiting(self._far) + len(answer)
        os.write(self._main, answer)
        for _ in range(int(TRANSIT / 0.0005)):
            if _waiting(self._far) >= wanted:
                return
            select.select([], [], [], 0.0005)
        raise LineError("the pseudo-terminal lost bytes; is the system well?")

    def close(self) -> None:
        """Close both ends."""
        for descriptor in (self._main, self._far):
            os.close(descriptor)
        self._main = self._far = -1


class SteppedClock(VirtualClock):
    """Simulated time that carries the chips behind its terminals along."""

    def __init__(self) -> None:
        super().__init__()
        self.terminals: dict[str, SteppedTerminal] = {}

    def serve(self, chip: Chip) -> str:
        """Put a chip behind a new pseudo-terminal and return its port."""
        terminal = SteppedTerminal(chip)
        chip.advance(self.time)
        self.terminals[terminal.port] = terminal
        return terminal.port

    def sent(self, port: str, count: int) -> None:
        """Learn that bytes were written to a port."""
        if port in self.terminals:
            self.terminals[port].sent(count)

    def check(self, port: str) -> None:
        """Raise `LineError` if the chip behind a port is unplugged."""
        terminal = self.terminals.get(port)
        if terminal is not None:
            terminal.chip.advance(self.time)
            if not terminal.chip.plugged:
                raise LineError(f"port {port} is unplugged; plug it in again")

    def step(self, deadline: float) -> None:
        """Go on to the next event of any chip, or to the deadline."""
        for terminal in self.terminals.values():
            terminal.pump(self.time)
        events = [t.chip.next_event() for t in self.terminals.values()]
        self.time = max(self.time, min([deadline, *events]))
        for terminal in self.terminals.values():
            terminal.pump(self.time)

    def sleep(self, seconds: float) -> None:
        """Advance the simulated time, and everything with it."""
        deadline = self.time + max(0.0, seconds)
        while self.time < deadline:
            self.step(deadline)

    def unserve(self, port: str) -> None:
        """Close the terminal of a port."""
        if (terminal := self.terminals.pop(port, None)) is not None:
            terminal.close()
