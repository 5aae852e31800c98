"""What a Grbl board does with a line: system commands and G-code."""

import re

import numpy as np

from rigs.firmware.grbl.block import (
    BlockError,
    GcodeBlock,
    check_leftovers,
    read_block,
    strip_comments,
)
from rigs.firmware.grbl.board import Board
from rigs.firmware.grbl.homing import Homing
from rigs.firmware.grbl.report import Reports
from rigs.firmware.grbl.settings import check_setting
from rigs.firmware.grbl.state import BLOCKS, INCH_MM, Modes

HELP = "[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]\r\n"
VERSION = "[VER:1.1h.20190830:]\r\n[OPT:V,15,128]\r\n"


class LineCommands:
    """Run the lines of one board."""

    def __init__(self, board: Board, reports: Reports) -> None:
        self.board, self.reports = board, reports
        self.state = board.state

    @property
    def modes(self) -> Modes:
        """The parser's modes, which a reset replaces."""
        return self.state.modes

    def line(self, text: str, *, overlong: bool = False) -> None:
        """Run one line and answer it."""
        bare = strip_comments(text)
        if overlong:
            self.board.answer(11)
        elif bare.startswith("$"):
            self._system(bare)
        elif bare and self.state.name in ("Alarm", "Jog"):
            self.board.answer(9)
        else:
            self.gcode_line(bare)

    def gcode_line(self, bare: str) -> None:
        """Run one line of G-code and answer it, unless it answers later."""
        try:
            later = self.gcode(bare)
        except BlockError as error:
            self.board.answer(error.number)
            return
        if not later:
            self.board.answer()

    # -- system commands ------------------------------------------------------------

    def _system(self, bare: str) -> None:
        board = self.board
        if bare == "$":
            board.send(HELP)
            board.answer()
        elif bare == "$G":
            board.send(self.reports.modes())
            board.answer()
        elif bare == "$X":
            self._unlock()
        elif bare.startswith("$J="):
            self._jog(bare[3:])
        elif bare == "$C":
            self._check_mode()
        elif self.state.name not in ("Idle", "Alarm", "Home"):
            board.answer(8)
        else:
            self._idle_command(bare)

    def _idle_command(self, bare: str) -> None:
        board = self.board
        reports = {
            "$$": self.reports.settings,
            "$#": self.reports.parameters,
            "$I": lambda: VERSION,
            "$N": lambda: "".join(
                f"$N{k}={line}\r\n" for k, line in enumerate(self.state.startup)
            ),
        }
        if bare in reports:
            board.send(reports[bare]())
            board.answer()
        elif bare.startswith("$H"):
            self._home(bare)
        elif bare == "$SLP":
            board.answer()
            board.send("[MSG:Sleeping]\r\n")
            self.state.name = "Sleep"
            self.reports.overrides_due = 0
        elif match := re.fullmatch(r"\$N([01])=(.*)", bare):
            self.state.startup[int(match[1])] = match[2]
            board.answer()
        else:
            self._setting(bare)

    def _setting(self, bare: str) -> None:
        board = self.board
        match = re.fullmatch(r"\$(\d+)=(.*)", bare)
        if match is None:
            board.answer(3 if re.match(r"\$(RST|N|H|I)", bare) else 2)
            return
        try:
            value = float(match[2])
        except ValueError:
            board.answer(2)
            return
        code = check_setting(self.state.settings, int(match[1]), value)
        if not code:
            self.state.settings[int(match[1])] = value
            self._after_setting(int(match[1]), value)
        board.answer(code)

    def _after_setting(self, number: int, value: float) -> None:
        if number == 22 and not value:
            self.state.settings[20] = 0
        if number == 13:
            self.reports.offset_due = 0

    def _unlock(self) -> None:
        board = self.board
        if self.state.name == "Alarm":
            board.send("[MSG:Caution: Unlocked]\r\n")
            self.state.name = "Idle"
        board.answer()

    def _check_mode(self) -> None:
        board = self.board
        if self.state.name == "Check":
            board.send("[MSG:Disabled]\r\nok\r\n")
            self.state.name = "Idle"
            board.soft_reset()
        elif self.state.name == "Idle":
            self.state.name = "Check"
            board.send("[MSG:Enabled]\r\n")
            board.answer()
        else:
            board.answer(8)

    def _home(self, bare: str) -> None:
        board = self.board
        if not self.state.settings[22]:
            board.answer(5)
            return
        self.state.name = "Home"
        if bare != "$H":
            board.answer(3)
            return
        self.state.homing_line = True
        Homing(board, self._homed).seek()

    def _homed(self) -> None:
        board = self.board
        if self.reports.pending:
            self.reports.pending = False
            board.send(self.reports.status())
        self.state.name = "Idle"
        self.state.homing_line = False
        board.run_startup()
        board.answer()
        board.wake()

    # -- G-code -----------------------------------------------------------------------

    def _jog(self, words: str) -> None:
        board = self.board
        if self.state.name not in ("Idle", "Jog"):
            board.answer(8)
            return
        try:
            block = read_block(words)
            if "F" not in block.values or block.has("G0", "G1"):
                raise BlockError(22)
            if set(block.codes) - {"G20", "G21", "G90", "G91", "G53"}:
                raise BlockError(16)
            target = self._target(block)
        except BlockError as error:
            board.answer(error.number)
            return
        if self._outside(target):
            board.answer(15)
            return
        if np.any(target != self.state.planned):
            scale = INCH_MM if block.has("G20") else 1.0
            board.plan(target, block.values["F"] * scale, jog=True)
        board.answer()

    def _outside(self, target: np.ndarray) -> bool:
        if not self.state.settings[20]:
            return False
        travel = self.state.axes(130)
        return bool(np.any(target > 1e-6) or np.any(target < -travel - 1e-6))

    def gcode(self, bare: str) -> bool:
        """Run a block; return whether it answers later.

        Raises
        ------
        BlockError
            With the number to answer.
        """
        block = read_block(bare)
        self._check(block)
        self._set_modes(block)
        return self._act(block)

    def _check(self, block: GcodeBlock) -> None:
        if block.has("G43.1") and not block.axes:
            raise BlockError(37)
        if block.has("G10"):
            self._check_g10(block)
        check_leftovers(block)
        moving = self._moves(block)
        motion = next((c for c in block.codes if c in ("G0", "G1", "G2", "G3")), None)
        motion = motion or self.modes.motion
        feed = block.values.get("F", self.modes.feed)
        if moving and motion != "G0" and not feed:
            raise BlockError(22)
        if block.has("G2", "G3") and not set("IJKR") & set(block.values):
            raise BlockError(35)

    def _check_g10(self, block: GcodeBlock) -> None:
        if not {"L", "P"} <= set(block.values) or not block.axes:
            raise BlockError(28)
        if block.values["P"] > 6:
            raise BlockError(29)
        if block.values["L"] not in (2, 20):
            raise BlockError(20)

    def _moves(self, block: GcodeBlock) -> bool:
        return bool(block.axes) and not block.has("G10", "G92", "G28", "G30", "G43.1")

    def _set_modes(self, block: GcodeBlock) -> None:
        groups = {
            "motion": ("G0", "G1", "G2", "G3", "G80"),
            "plane": ("G17", "G18", "G19"),
            "units": ("G20", "G21"),
            "distance": ("G90", "G91"),
            "feed_mode": ("G93", "G94"),
            "system": ("G54", "G55", "G56", "G57", "G58", "G59"),
        }
        for name, codes in groups.items():
            for code in codes:
                if code in block.codes:
                    if name == "system" and code != self.modes.system:
                        self.reports.offset_due = 0
                    setattr(self.modes, name, code)
        self.modes.feed = block.values.get("F", self.modes.feed)
        self.modes.tool = int(block.values.get("T", self.modes.tool))

    def _target(self, block: GcodeBlock) -> np.ndarray:
        modes = self.modes
        units = next((c for c in ("G20", "G21") if block.has(c)), modes.units)
        scale = INCH_MM if units == "G20" else 1.0
        distance = next((c for c in block.codes if c in ("G90", "G91")), modes.distance)
        target = self.state.planned.copy()
        for letter, value in block.axes.items():
            k = "XYZ".index(letter)
            if block.has("G53"):
                target[k] = value * scale
            elif distance == "G91":
                target[k] += value * scale
            else:
                target[k] = value * scale + self.state.work_offset()[k]
        return target

    def _act(self, block: GcodeBlock) -> bool:
        board = self.board
        if self.state.name == "Check":
            return False
        if block.has("M30", "M2"):
            board.send("[MSG:Pgm End]\r\n")
            return False
        if block.has("G4"):
            return self._dwell(block.values.get("P", 0.0))
        if block.has("G92", "G92.1"):
            self._shift(block)
            return False
        if block.has("G10"):
            return self._store(block)
        if self._moves(block) and self.modes.motion in ("G0", "G1"):
            return self._move(block)
        return False

    def _dwell(self, seconds: float) -> bool:
        board = self.board

        def end() -> None:
            self.state.blocked = False
            board.answer()
            board.wake()

        def begin() -> None:
            self.state.blocked = False
            self._block_for(seconds, end)

        board.when_still(begin)
        return True

    def _block_for(self, seconds: float, end) -> None:
        self.state.waiting = lambda: None

        def done() -> None:
            self.state.waiting = None
            end()

        self.board.schedule(seconds, done)

    def _shift(self, block: GcodeBlock) -> None:
        scale = INCH_MM if self.modes.units == "G20" else 1.0
        if block.has("G92.1"):
            self.state.g92 = np.zeros(3)
        for letter, value in block.axes.items():
            k = "XYZ".index(letter)
            base = self.state.planned[k] - self.state.offsets[self.modes.system][k]
            self.state.g92[k] = base - value * scale
        self.reports.offset_due = 0

    def _store(self, block: GcodeBlock) -> bool:
        board = self.board
        number = int(block.values["P"])
        system = f"G{53 + number}" if block.values["P"] else self.modes.system

        def act() -> None:
            for letter, value in block.axes.items():
                k = "XYZ".index(letter)
                if block.values["L"] == 20:
                    value = self.state.planned[k] - self.state.g92[k] - value
                self.state.offsets[system][k] = value
            self.reports.offset_due = 0
            board.answer()

        board.when_still(act)
        return True

    def _move(self, block: GcodeBlock) -> bool:
        board = self.board
        target = self._target(block)
        if self._outside(target) and self.state.name != "Home":
            self._soft_limit()
            return True
        scale = INCH_MM if self.modes.units == "G20" else 1.0
        feed = np.inf if self.modes.motion == "G0" else self.modes.feed * scale
        if len(self.state.queue) >= BLOCKS:
            self.state.waiting = lambda: (board.plan(target, feed), board.answer())[1]
            return True
        if np.any(np.abs(target - self.state.planned) > 1e-9):
            board.plan(target, feed)
        return False

    def _soft_limit(self) -> None:
        board = self.board
        self.state.swallowed = True

        def alarm() -> None:
            board.alarm(2, critical=True)

        if self.state.glide is None:
            alarm()
            return
        self.state.name, self.state.substate = "Hold", 1
        board.brake(alarm)
