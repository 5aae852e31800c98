"""The dialogue with a Grbl board: lines out, replies in, nothing believed blindly."""

import logging
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rigs.clock import Clock
from rigs.faults import AlarmError, RebootError, RefusedError, SilenceError
from rigs.grbl.codes import alarm_text, error_text
from rigs.grbl.parsing import (
    Alarm,
    Banner,
    Feedback,
    Noise,
    Ok,
    Refused,
    SettingLine,
    Status,
    Word,
    read_word,
)
from rigs.lines.serial import Line

log = logging.getLogger(__name__)

SOFT_RESET = b"\x18"
JOG_CANCEL = b"\x85"
HOLD = b"!"
RESUME = b"~"
ASK = b"?"


@dataclass(frozen=True)
class Patience:
    """How long the driver waits, in seconds."""

    boot: float = 2.0
    reply: float = 2.0
    status: float = 0.5
    status_tries: int = 4
    stop: float = 4.0


class GrblLink:
    """Exchange lines with a board and notice everything it says unasked.

    Parameters
    ----------
    line
        The open line.
    clock
        Time the waiting is counted in.
    patience
        How long to wait for what.
    """

    def __init__(
        self, line: Line, clock: Clock, patience: Patience | None = None
    ) -> None:
        self.line = line
        self.clock = clock
        self.patience = patience or Patience()
        self.banner: Banner | None = None
        self.reboots = 0
        self.noise = 0
        self.messages: deque[str] = deque(maxlen=50)
        self.offset: np.ndarray | None = None
        self._partial = b""
        self._words: deque[Word] = deque()

    # -- reading --------------------------------------------------------------------

    def next(self, timeout: float) -> Word | None:
        """Return the next word, None if none comes in time."""
        deadline = self.clock.now() + timeout
        while not self._words:
            data = self.line.read(max(0.0, deadline - self.clock.now()))
            self._split(data)
            if not self._words and self.clock.now() >= deadline and not data:
                return None
        word = self._words.popleft()
        self._notice(word)
        return word

    def _split(self, data: bytes) -> None:
        *lines, self._partial = (self._partial + data).split(b"\n")
        self._partial = self._partial[-200:]
        for raw in lines:
            text = raw.strip(b"\r").decode("latin-1")
            if text:
                log.debug("<- %r", text)
                self._words.append(read_word(text))

    def _notice(self, word: Word) -> None:
        if isinstance(word, Banner):
            self.banner = word
            self.offset = None
        elif isinstance(word, Feedback):
            self.messages.append(word.text)
        elif isinstance(word, Noise):
            self.noise += 1
        elif isinstance(word, Status) and word.offset is not None:
            self.offset = word.offset

    def drain(self) -> list[Word]:
        """Return everything that has arrived unasked."""
        words = []
        while (word := self.next(0.0)) is not None:
            words.append(word)
        return words

    def check_unasked(self) -> None:
        """Raise what the board said unasked.

        Raises
        ------
        RebootError, AlarmError
            For a banner or an alarm among the unread replies.
        """
        for word in self.drain():
            self.raise_events(word)

    def raise_events(self, word: Word | None) -> None:
        """Raise a banner or an alarm as the error it is."""
        if isinstance(word, Banner):
            self.reboots += 1
            raise RebootError(
                "the controller restarted by itself (power loss, reset button or "
                "interference); its position is lost; home it again"
            )
        if isinstance(word, Alarm):
            raise AlarmError(
                f"the controller stopped with {alarm_text(word.code)}", word.code
            )

    # -- writing ----------------------------------------------------------------------

    def send(self, data: bytes) -> None:
        """Write bytes as they are."""
        log.debug("-> %r", data)
        self.line.write(data)

    def command(self, text: str, timeout: float | None = None) -> list[Word]:
        """Send one line, wait for its ok, return what came before it.

        Raises
        ------
        RefusedError, AlarmError, RebootError, SilenceError
            As the board answers, or does not.
        """
        self.check_unasked()
        self.send(text.encode() + b"\n")
        return self.answer(text, self.patience.reply if timeout is None else timeout)

    def answer(self, text: str, timeout: float) -> list[Word]:
        """Wait for the ok of a line already sent."""
        deadline = self.clock.now() + timeout
        before: list[Word] = []
        while (left := deadline - self.clock.now()) >= 0.0:
            word = self.next(left)
            if word is None:
                break
            if isinstance(word, Ok):
                return before
            if isinstance(word, Refused):
                raise RefusedError(
                    f"the controller refused {text!r}: {error_text(word.code)}",
                    word.code,
                )
            self.raise_events(word)
            before.append(word)
        raise SilenceError(
            f"no answer to {text!r} within {timeout:.1f} s; the controller may be "
            "locked, off, or the line disturbed"
        )

    def stream(self, lines: Sequence[str], window: int = 0) -> None:
        """Send lines one by one, or as many at once as fit a buffer.

        Parameters
        ----------
        lines
            Lines of G-code, none of which writes settings or offsets.
        window
            Bytes that may be unanswered: 0 sends each line after the ok of the one
            before; at most 127 fit a Grbl board's buffer.
        """
        self.check_unasked()
        flying: deque[str] = deque()
        for text in lines:
            while flying and sum(len(t) + 1 for t in flying) + len(text) + 1 > window:
                self.answer(flying[0], self.patience.reply)
                flying.popleft()
            self.send(text.encode() + b"\n")
            flying.append(text)
        while flying:
            self.answer(flying[0], self.patience.reply)
            flying.popleft()

    def status(self) -> Status:
        """Ask for a status report, several times if need be.

        Raises
        ------
        SilenceError, RebootError, AlarmError
            As the board answers, or does not.
        """
        self.check_unasked()
        for _ in range(self.patience.status_tries):
            self.send(ASK)
            if status := self.await_status(self.patience.status):
                return status
        total = self.patience.status * self.patience.status_tries
        raise SilenceError(
            f"no status report within {total:.1f} s; the controller is off, locked "
            "after an alarm, or the line is disturbed"
        )

    def await_status(self, timeout: float) -> Status | None:
        """Return the next status report, None if none comes in time."""
        deadline = self.clock.now() + timeout
        while (left := deadline - self.clock.now()) >= 0.0:
            word = self.next(left)
            if isinstance(word, Status):
                return word
            self.raise_events(word)
            if word is None:
                return None
        return None

    def soft_reset(self) -> None:
        """Reset the board and wait for its banner; older replies are forgotten.

        Raises
        ------
        SilenceError
            If no banner comes.
        """
        self.drain()
        self.send(SOFT_RESET)
        deadline = self.clock.now() + self.patience.boot
        while (left := deadline - self.clock.now()) >= 0.0:
            word = self.next(left)
            if isinstance(word, Banner):
                self._pause()
                return
            if word is None:
                break
        raise SilenceError(
            f"no banner within {self.patience.boot:.1f} s after a reset; check power "
            "and cable, and that the board runs Grbl 1.1 or grblHAL"
        )

    def _pause(self) -> None:
        """Let the messages that follow a banner arrive."""
        while self.next(0.05) is not None:
            pass

    def settings(self) -> dict[int, float]:
        """Return the ``$$`` settings."""
        words = self.command("$$")
        return {w.number: w.value for w in words if isinstance(w, SettingLine)}

    def feedback(self, text: str) -> list[str]:
        """Send a query and return the bracketed lines of its answer."""
        return [w.text for w in self.command(text) if isinstance(w, Feedback)]

    def settled(self) -> tuple[Status, np.ndarray]:
        """Return two equal reports' state and machine position.

        Raises
        ------
        SilenceError
            If the reports keep changing or stay away.
        """
        last: tuple[Status, np.ndarray] | None = None
        for _ in range(12):
            status = self.status()
            here = self.machine_position(status)
            if here is None:
                continue
            same = last is not None and last[0].state == status.state
            if last is not None and same and np.array_equal(last[1], here):
                return status, here
            last = status, here
            self.clock.sleep(0.02)
        raise SilenceError(
            "the status reports do not agree with each other; "
            "is something else moving the machine?"
        )

    def machine_position(self, status: Status) -> np.ndarray | None:
        """Return the machine position, None while the work offset is not known."""
        if status.machine is not None:
            return status.machine
        if status.work is None or self.offset is None:
            return None
        return status.work + self.offset
