"""Keep the audio interface open for a whole session, and open it again if it fails."""

from collections.abc import Callable
from typing import Any

from capture.interfaces import AudioInterface
from rigs import Clock
from rir import InterfaceError, SessionError

__all__ = ["HeldInterface"]

REOPENINGS = 3  # a driver that restarts is there at the second
REOPEN_WAIT_S = 2.0  # USB devices take one to two seconds to come back


class HeldInterface:
    """One interface, opened when first needed.

    Parameters
    ----------
    open_interface : callable
        Opens the device.
    clock : Clock
        Passes the time a device gets to come back.
    record : callable
        Journals that the device was opened.
    show : callable
        Shows what goes wrong meanwhile.
    """

    def __init__(
        self,
        open_interface: Callable[[], AudioInterface],
        clock: Clock,
        *,
        record: Callable[[dict[str, Any]], None],
        show: Callable[[dict[str, Any]], None],
    ) -> None:
        self._open = open_interface
        self._clock = clock
        self._record = record
        self._show = show
        self._interface: AudioInterface | None = None
        self._was_open = False

    def get(self) -> AudioInterface:
        """Return the open interface; after a failure, wait for the device to return.

        Raises
        ------
        SessionError
            If it does not come back; the session can be resumed.
        """
        if self._interface is None:
            self._interface = self._reopen()
            self._was_open = True
            about = self._interface.describe()
            self._record({"event": "interface_opened", "about": about})
        return self._interface

    def _reopen(self) -> AudioInterface:
        tries = REOPENINGS if self._was_open else 1
        while True:
            try:
                return self._open()
            except InterfaceError as error:
                tries -= 1
                if not tries:
                    raise SessionError(
                        f"{error}; the session stops here: run again to resume it"
                    ) from error
                self._show({"event": "warning", "text": str(error)})
                self._clock.sleep(REOPEN_WAIT_S)

    def drop(self) -> None:
        """Close the interface, so that the next take opens it afresh."""
        if self._interface is not None:
            self._interface.close()
            self._interface = None
