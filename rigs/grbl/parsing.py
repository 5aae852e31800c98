"""Grbl's replies, read strictly: what is not exactly right is noise."""

import re
from dataclasses import dataclass

import numpy as np

STATES = (
    "Idle", "Run", "Jog", "Hold", "Door", "Home", "Alarm", "Check", "Sleep", "Tool"
)  # fmt: skip
NUMBER = r"-?\d+\.\d{3,4}"
VECTOR = rf"{NUMBER}(?:,{NUMBER}){{2,7}}"
STATUS = re.compile(rf"<({'|'.join(STATES)})(?::(\d+))?\|([MW])Pos:({VECTOR})(.*)>")
FIELDS = re.compile(r"(?:\|[A-Za-z]+(?::[A-Za-z0-9.,:+-]*)?)*")
FEED = re.compile(r"\d+(\.\d+)?(,\d+)*")
ALARM = re.compile(r"ALARM:(\d+)")
ERROR = re.compile(r"error:(\d+)")
SETTING = re.compile(r"\$(\d+)=([-+]?\d+(?:\.\d+)?)")
STARTUP = re.compile(r">.*:(ok|error:\d+)")
BANNER = re.compile(r"(Grbl|GrblHAL) (\d+\.\d+\w?) \[.*\]")


@dataclass(frozen=True)
class Ok:
    """A line was taken."""


@dataclass(frozen=True)
class Refused:
    """A line was refused with a number."""

    code: int


@dataclass(frozen=True)
class Alarm:
    """An alarm was raised."""

    code: int


@dataclass(frozen=True)
class Banner:
    """The controller has just started."""

    family: str
    version: str


@dataclass(frozen=True)
class SettingLine:
    """One ``$`` setting."""

    number: int
    value: float


@dataclass(frozen=True)
class Feedback:
    """A bracketed message, without its brackets."""

    text: str


@dataclass(frozen=True)
class Noise:
    """A line that is none of the others."""

    text: str


@dataclass(frozen=True, eq=False)
class Status:
    """A status report; positions in the units of the report."""

    state: str
    substate: int | None
    machine: np.ndarray | None
    work: np.ndarray | None
    offset: np.ndarray | None
    pins: str
    blocks: int | None


Word = Ok | Refused | Alarm | Banner | SettingLine | Feedback | Status | Noise


def _vector(text: str) -> np.ndarray:
    return np.array([float(part) for part in text.split(",")])


def read_status(line: str) -> Status | None:
    """Read a status report; None if anything about it is odd.

    Examples
    --------
    >>> read_status("<Idle|MPos:-2.000,0.000,0.000|FS:0,0>").machine.tolist()
    [-2.0, 0.0, 0.0]
    >>> read_status("<R0n|MPos:-8.692,-2.000,-2.000|FS:3000,0>") is None
    True
    """
    match = STATUS.fullmatch(line)
    if match is None or not FIELDS.fullmatch(match[5]):
        return None
    parts = [part.partition(":") for part in str(match[5]).split("|")[1:]]
    fields: dict[str, str] = {name: value for name, _, value in parts}
    feed = fields.get("FS", fields.get("F", "0"))
    offset = fields.get("WCO")
    if not FEED.fullmatch(feed) or (offset and not re.fullmatch(VECTOR, offset)):
        return None
    here = _vector(match[4])
    blocks = fields.get("Bf", "").partition(",")[0]
    return Status(
        state=match[1],
        substate=int(match[2]) if match[2] else None,
        machine=here if match[3] == "M" else None,
        work=here if match[3] == "W" else None,
        offset=_vector(offset) if offset else None,
        pins=fields.get("Pn", ""),
        blocks=int(blocks) if blocks.isdigit() else None,
    )


def read_word(line: str) -> Word:
    """Read one line of a Grbl board."""
    if line == "ok":
        return Ok()
    if line.startswith("<"):
        return read_status(line) or Noise(line)
    if match := ERROR.fullmatch(line):
        return Refused(int(match[1]))
    if match := ALARM.fullmatch(line):
        return Alarm(int(match[1]))
    if match := SETTING.fullmatch(line):
        return SettingLine(int(match[1]), float(match[2]))
    if match := BANNER.fullmatch(line):
        return Banner(match[1], match[2])
    if line.startswith("[") and line.endswith("]") and line.isprintable():
        return Feedback(line[1:-1])
    if STARTUP.fullmatch(line):
        return Feedback(line)
    return Noise(line)
