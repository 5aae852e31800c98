"""A pseudo-terminal with a firmware model behind it, so that pyserial is exercised."""

import os
import select
import threading

from rigs.clock import Clock, FastClock
from rigs.firmware.chip import Chip


class PseudoTerminal:
    """Serve a chip on a pseudo-terminal until closed.

    Parameters
    ----------
    chip
        The firmware model.
    clock
        Its time; a hundred times faster than real time by default.

    Attributes
    ----------
    port
        The path to open as a serial port.
    """

    def __init__(self, chip: Chip, clock: Clock | None = None) -> None:
        import tty

        self.chip = chip
        self.clock = clock or FastClock()
        self._main, self._far = os.openpty()
        tty.setraw(self._main)
        tty.setraw(self._far)
        self.port = os.ttyname(self._far)
        self._stop = threading.Event()
        self._start = self.clock.now() - chip.now
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def now(self) -> float:
        """Return the chip's time."""
        return self.clock.now() - self._start

    def _serve(self) -> None:
        while not self._stop.is_set():
            readable, _, _ = select.select([self._main], [], [], 0.001)
            data = os.read(self._main, 4096) if readable else b""
            self.chip.advance(self.now())
            if not self.chip.plugged:
                continue
            if data:
                self.chip.receive(data)
                self.chip.advance(self.now())
            if answer := self.chip.take():
                os.write(self._main, answer)

    def wait(self) -> None:
        """Wait until closed from elsewhere, or interrupted."""
        while not self._stop.wait(0.2):
            pass

    def close(self) -> None:
        """Stop serving and close both ends."""
        if self._stop.is_set():
            return
        self._stop.set()
        self._thread.join()
        os.close(self._main)
        os.close(self._far)
