"""The append-only record of a session: one event a line, safe against power loss."""

from __future__ import annotations

import json
import logging
import math
import os
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from rir.errors import SessionError

log = logging.getLogger(__name__)

Event = dict[str, Any]


def plain(value: Any) -> Any:
    """Turn a value into what JSON can hold; NaN and infinity become ``None``.

    Examples
    --------
    >>> plain({"t": float("nan"), "xyz": (1, 2.5)})
    {'t': None, 'xyz': [1, 2.5]}
    """
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (str, bool, int)) or value is None:
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, (np.ndarray, np.generic)):
        return plain(value.tolist())
    if isinstance(value, (list, tuple, set)):
        return [plain(item) for item in value]
    return str(value)


def checksum(event: Mapping[str, Any]) -> str:
    """Return the CRC-32 of an event's own text, as eight hexadecimal digits."""
    text = json.dumps(event, sort_keys=True, allow_nan=False)
    return f"{zlib.crc32(text.encode()):08x}"


def encode(event: Mapping[str, Any]) -> bytes:
    """Return the journal line of an event, its checksum included."""
    body = plain(event)
    line = json.dumps({**body, "crc": checksum(body)}, allow_nan=False)
    return line.encode() + b"\n"


def decode(line: bytes) -> Event | None:
    """Return the event of a journal line, or None if it is torn or was changed."""
    try:
        event = json.loads(line)
    except ValueError:
        return None
    if not isinstance(event, dict):
        return None
    stated = event.pop("crc", None)
    return event if stated == checksum(event) else None


@dataclass
class JournalText:
    """What a journal file says."""

    events: list[Event] = field(default_factory=list)
    """The trustworthy events, in order."""
    torn: bytes = b""
    """The unfinished last line, empty if there is none."""
    changed: list[int] = field(default_factory=list)
    """Numbers (from 1) of the lines that no longer match their checksum."""

    def complaints(self) -> list[str]:
        """Return one clear line for each thing wrong with the file."""
        lines = [
            f"journal line {number} was changed after it was written; "
            "it is ignored and what it recorded is checked again"
            for number in self.changed
        ]
        if self.torn:
            lines.append(
                f"the journal's last line is torn ({len(self.torn)} bytes, "
                "the process ended while writing it); it is dropped"
            )
        return lines


def read_journal(path: Path) -> JournalText:
    """Read a journal; a torn last line and changed lines are set apart.

    Parameters
    ----------
    path : Path
        The journal file; a missing file reads as empty.

    Returns
    -------
    JournalText
        The events and what is wrong.
    """
    text = JournalText()
    if not path.exists():
        return text
    *lines, rest = path.read_bytes().split(b"\n")
    for number, line in enumerate(lines, start=1):
        event = decode(line)
        if event is not None:
            text.events.append(event)
        elif line.strip():
            text.changed.append(number)
    text.torn = rest
    return text


class Journal:
    """An open journal; each :meth:`write` is on the disk when it returns.

    Parameters
    ----------
    path : Path
        The journal file, created when missing. A torn last line is cut off.

    Raises
    ------
    InterfaceError
        If another process is writing the same journal.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: Any = path.open("ab", buffering=0)
        try:
            _lock(self._file.fileno())
        except OSError as error:
            self._file.close()
            raise SessionError(
                f"another program is writing {path}; wait for it to end, "
                "or choose another --out"
            ) from error
        self.text = read_journal(path)
        if self.text.torn:
            self._file.truncate(path.stat().st_size - len(self.text.torn))

    def write(self, event: Mapping[str, Any]) -> None:
        """Append one event and wait until the disk has it.

        Raises
        ------
        SessionError
            If the disk does not take the line; what was written stays whole.
        """
        size = self.path.stat().st_size
        try:
            _write_all(self._file, encode(event))
            os.fsync(self._file.fileno())
        except OSError as error:
            os.truncate(self.path, size)
            raise SessionError(
                f"cannot write {self.path}: {error.strerror}; "
                "free some space and run again, the session resumes"
            ) from error

    def __iter__(self) -> Iterator[Event]:
        """Go through the events that were there when the journal was opened."""
        return iter(self.text.events)

    def close(self) -> None:
        """Release the file."""
        self._file.close()

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


def _write_all(file: Any, data: bytes) -> None:
    while data:
        data = data[file.write(data) :]


def _lock(descriptor: int) -> None:
    """Take the file for this process alone, where the system can do that."""
    try:
        import fcntl
    except ImportError:
        return
    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
