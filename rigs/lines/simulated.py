"""Lines from port names, simulated boards included."""

from rigs.clock import Clock, VirtualClock
from rigs.firmware.chip import Chip
from rigs.lines.direct import DirectLine
from rigs.lines.serial import Line, SerialLine

SIMULATED = "simulated"
"""The port name behind which a firmware model answers."""


class ServedLine(SerialLine):
    """A serial line to a firmware model on a pseudo-terminal of its own."""

    def __init__(self, chip: Chip, clock: Clock) -> None:
        from rigs.lines.stepped import SteppedClock
        from rigs.lines.terminal import PseudoTerminal

        self._end = lambda: None
        if isinstance(clock, SteppedClock):
            port = clock.serve(chip)
            self._end = lambda: clock.unserve(port)
        else:
            terminal = PseudoTerminal(chip, clock)
            port = terminal.port
            self._end = terminal.close
        super().__init__(port, clock=clock)

    def finish(self) -> None:
        """Close the port and the pseudo-terminal behind it."""
        self.close()
        self._end()


def simulated_line(chip: Chip, clock: Clock) -> Line:
    """Connect a firmware model: straight in plain simulated time, else by a port."""
    if type(clock) is VirtualClock:
        return DirectLine(chip, clock)
    return ServedLine(chip, clock)
