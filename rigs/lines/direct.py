"""A line straight into a firmware model, in simulated time: no threads, no waiting."""

from rigs.clock import VirtualClock
from rigs.faults import LineError
from rigs.firmware.chip import Chip


class DirectLine:
    r"""Connect a driver with a chip that share one simulated clock.

    Examples
    --------
    >>> from rigs.firmware.grbl.firmware import GrblFirmware
    >>> clock = VirtualClock()
    >>> line = DirectLine(GrblFirmware(), clock)
    >>> line.write(b"?")
    >>> line.read(1.0)
    b'<Idle|MPos:0.000,0.000,0.000|FS:0,0|WCO:0.000,0.000,0.000>\r\n'
    """

    def __init__(self, chip: Chip, clock: VirtualClock) -> None:
        self.chip = chip
        self.clock = clock
        self.sent = bytearray()
        chip.advance(clock.now())

    def open(self) -> None:
        """Connect.

        Raises
        ------
        LineError
            If the line is unplugged.
        """
        self.chip.advance(self.clock.now())
        self._check()

    def _check(self) -> None:
        if not self.chip.plugged:
            raise LineError("the simulated line is unplugged; plug it in again")

    def write(self, data: bytes) -> None:
        """Send bytes."""
        self.chip.advance(self.clock.now())
        self._check()
        self.sent.extend(data)
        self.chip.receive(data)

    def read(self, timeout: float) -> bytes:
        """Return what has arrived, waiting up to `timeout` seconds for a byte."""
        deadline = self.clock.now() + timeout
        while True:
            self.chip.advance(self.clock.now())
            self._check()
            data = self.chip.take()
            if data or self.clock.now() >= deadline:
                return data
            self.clock.time = min(self.chip.next_event(), deadline)

    def close(self) -> None:
        """Do nothing: there is no port."""

    def finish(self) -> None:
        """Do nothing: there is no port."""
