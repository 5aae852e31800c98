"""G-code blocks as Grbl 1.1 reads them: words, modal groups, and what is wrong."""

import re
from dataclasses import dataclass, field

from rir.errors import ResoundingError

MOTION = {"G0", "G1", "G2", "G3", "G38.2", "G38.3", "G38.4", "G38.5", "G80"}
NON_MODAL = {"G4", "G10", "G28", "G30", "G28.1", "G30.1", "G53", "G92", "G92.1"}
WITH_AXES = {"G10", "G28", "G30", "G92"}
GROUPS = (
    MOTION,
    {"G17", "G18", "G19"},
    {"G20", "G21"},
    {"G90", "G91"},
    {"G93", "G94"},
    {"G54", "G55", "G56", "G57", "G58", "G59"},
    NON_MODAL,
    {"G43.1", "G49"},
    {"G40"},
    {"G61"},
    {"G91.1"},
    {"M0", "M2", "M30"},
    {"M3", "M4", "M5"},
    {"M8", "M9"},
)
KNOWN = set().union(*GROUPS)
WORD = re.compile(r"([A-Z])([-+]?(?:\d+\.?\d*|\.\d+))")
REFUSED_M_AND_G = 20  # STATUS_GCODE_UNSUPPORTED_COMMAND of Grbl 1.1


class BlockError(ResoundingError, ValueError):
    """A block is refused with an error number."""

    def __init__(self, number: int) -> None:
        super().__init__(f"error:{number}")
        self.number = number


@dataclass
class GcodeBlock:
    """The words of one line."""

    codes: list[str] = field(default_factory=list)
    values: dict[str, float] = field(default_factory=dict)

    @property
    def axes(self) -> dict[str, float]:
        """The axis words."""
        return {k: v for k, v in self.values.items() if k in "XYZ"}

    def has(self, *codes: str) -> bool:
        """Tell whether any of the codes is in the block."""
        return any(code in self.codes for code in codes)


def strip_comments(line: str) -> str:
    """Return a line as the parser sees it: no spaces, no comments, upper case."""
    bare = re.sub(r"\(.*?\)|;.*|\s", "", line).upper()
    return bare


def read_block(line: str) -> GcodeBlock:
    """Split a stripped line into codes and values.

    Raises
    ------
    BlockError
        With the number Grbl answers.
    """
    block, place = GcodeBlock(), 0
    while place < len(line):
        match = WORD.match(line, place)
        if match is None:
            raise BlockError(2 if line[place].isalpha() else 1)
        _enter(block, match[1], match[2])
        place = match.end()
    return block


def _enter(block: GcodeBlock, letter: str, number: str) -> None:
    if letter in "GM":
        value = float(number)
        code = f"{letter}{value:g}"
        if code not in KNOWN:
            raise BlockError(_unknown(letter, value))
        _check_conflicts(block, code)
        block.codes.append(code)
        return
    if letter not in "FIJKLNPRSTXYZ":
        raise BlockError(20)
    if letter in block.values:
        raise BlockError(25)
    if letter in "FNPTS" and float(number) < 0:
        raise BlockError(4)
    if letter == "T" and float(number) > 255:
        raise BlockError(38)
    block.values[letter] = float(number)


def _unknown(letter: str, value: float) -> int:
    tenth = round(10 * (value % 1))
    groups = {"G59"} if letter == "G" else set()
    return 23 if tenth and f"{letter}{int(value)}" in groups else REFUSED_M_AND_G


def _uses_axes(code: str) -> bool:
    return (code in MOTION and code != "G80") or code in WITH_AXES or code == "G43.1"


def _check_conflicts(block: GcodeBlock, code: str) -> None:
    if _uses_axes(code) and any(_uses_axes(known) for known in block.codes):
        raise BlockError(24)
    for group in GROUPS:
        if code in group and any(known in group for known in block.codes):
            both = {code, *block.codes} & group
            if not ({"G53"} & both and both <= {"G53"} | {"G53"}):
                raise BlockError(21)


def check_leftovers(block: GcodeBlock) -> None:
    """Refuse words no code of the block uses.

    Raises
    ------
    BlockError
        36 for unused words.
    """
    used = set("FNSTXYZ")
    if block.has("G4", "G10"):
        used |= {"P"}
    if block.has("G10"):
        used |= {"L"}
    if block.has("G2", "G3"):
        used |= set("IJKRP")
    if set(block.values) - used:
        raise BlockError(36)
