"""Serial lines: the only file that knows pyserial."""

from contextlib import suppress
from typing import Any, Protocol, runtime_checkable

from rigs.clock import Clock, SystemClock
from rigs.faults import LineError
from rir.optional import require

READ_STEP = 0.005  # s a read waits: far below time-outs, without a busy loop


@runtime_checkable
class SteppedTime(Protocol):
    """A simulated clock that must be told when to go on."""

    def step(self, deadline: float) -> None:
        """Go on to the next event."""
        ...

    def sent(self, port: str, count: int) -> None:
        """Learn that bytes were written."""
        ...

    def check(self, port: str) -> None:
        """Raise `LineError` if the port is unplugged."""
        ...


@runtime_checkable
class Line(Protocol):
    """Carry bytes; whoever reads gives a time-out."""

    def open(self) -> None:
        """Open, or open again."""
        ...

    def write(self, data: bytes) -> None:
        """Send bytes."""
        ...

    def read(self, timeout: float) -> bytes:
        """Return what has arrived, waiting up to `timeout` seconds for a byte."""
        ...

    def close(self) -> None:
        """Close for now; `open` may follow. A second call does nothing."""
        ...

    def finish(self) -> None:
        """Close for good."""
        ...


class SerialLine:
    """Talk over anything pyserial can open by name or URL.

    Parameters
    ----------
    port
        ``/dev/ttyUSB0``, ``COM3``, ``socket://host:port``, ``spy://port?file=log``…
    baud
        Bits per second.
    clock
        Time the time-outs are counted in.
    assert_dtr
        Whether the line's DTR is raised on opening; many boards reset on it, so it
        is left low where the port allows.
    """

    def __init__(
        self,
        port: str,
        baud: int = 115200,
        clock: Clock | None = None,
        *,
        assert_dtr: bool = False,
    ) -> None:
        self.port = port
        self.baud = baud
        self.clock = clock or SystemClock()
        self.assert_dtr = assert_dtr
        self._stepped = self.clock if isinstance(self.clock, SteppedTime) else None
        self._serial: Any = None

    def open(self) -> None:
        """Open the port, exclusively where the system can.

        Raises
        ------
        LineError
            If the port is missing or in use.
        """
        serial = require("serial", why="a serial rig")
        self.close()
        step = 0.0 if self._stepped else READ_STEP
        try:
            self._check()
            line = serial.serial_for_url(
                self.port, self.baud, timeout=step, do_not_open=True
            )
            _set_quietly(line, "exclusive", True)
            _set_quietly(line, "dtr", self.assert_dtr)
            _set_quietly(line, "rts", self.assert_dtr)
            line.open()
        except (OSError, ValueError) as error:
            raise LineError(
                f"port {self.port} cannot be opened: {error}; `rig ports` lists the "
                "ports there are; close other programs that use it"
            ) from error
        self._serial = line

    def write(self, data: bytes) -> None:
        """Send bytes."""
        try:
            self._check()
            self._opened().write(data)
            if self._stepped:
                self._stepped.sent(self.port, len(data))
        except OSError as error:
            raise self._gone(error) from error

    def read(self, timeout: float) -> bytes:
        """Return what has arrived, waiting up to `timeout` seconds for a byte."""
        line = self._opened()
        deadline = self.clock.now() + timeout
        try:
            while True:
                data = line.read(max(1, line.in_waiting))
                if data or self.clock.now() >= deadline:
                    return data
                if self._stepped:
                    self._stepped.step(deadline)
                    self._check()
        except (OSError, TypeError) as error:
            raise self._gone(error) from error

    def close(self) -> None:
        """Close the port; errors of a port that is gone already are ignored."""
        if self._serial is not None:
            line, self._serial = self._serial, None
            with suppress(OSError):
                line.close()

    def finish(self) -> None:
        """Close the port for good."""
        self.close()

    def _check(self) -> None:
        if self._stepped:
            self._stepped.check(self.port)

    def _opened(self):
        if self._serial is None:
            raise LineError(f"port {self.port} is not open; connect first")
        return self._serial

    def _gone(self, error: Exception) -> LineError:
        self.close()
        return LineError(
            f"port {self.port} is gone ({error}); check cable and power, then connect "
            "and home again"
        )


def _set_quietly(line: object, name: str, value: bool) -> None:
    """Set an option before opening; pseudo-terminals and sockets lack some."""
    with suppress(OSError, ValueError, AttributeError):
        setattr(line, name, value)


def list_ports() -> list[tuple[str, str]]:
    """Return (port, description) of the serial ports the system knows."""
    require("serial", why="a serial rig")
    from serial.tools import list_ports as known

    return [(port.device, str(port.description)) for port in known.comports()]
