"""What a Grbl board reports: states, positions, settings, parameters."""

import numpy as np

from rigs.firmware.grbl.board import Board
from rigs.firmware.grbl.settings import print_setting
from rigs.firmware.grbl.state import BLOCKS, INCH_MM

BUSY = ("Run", "Jog", "Hold", "Door", "Home")


class Reports:
    """Write the reports of one board."""

    def __init__(self, board: Board) -> None:
        self.board = board
        self.pending = False
        self.reset()

    def reset(self) -> None:
        """Start the cadence of the rarer fields again."""
        self.offset_due = 0
        self.overrides_due = 0
        self.overrides = [100, 100, 100]
        self.pending = False

    def vector(self, values: np.ndarray) -> str:
        """Return comma-separated coordinates in the units of the reports."""
        inches = bool(self.board.state.settings[13])
        scale, digits = (1 / INCH_MM, 4) if inches else (1.0, 3)
        return ",".join(f"{value * scale + 0.0:.{digits}f}" for value in values)

    def pins(self) -> str:
        """Return the letters of the switches pressed."""
        pressed = self.board.true_position >= -1e-9
        homed = bool(self.board.state.settings[22])
        return "".join("XYZ"[k] for k in range(3) if pressed[k] and homed)

    def ask(self) -> None:
        """Answer a question mark, now or when homing ends."""
        board = self.board
        if board.state.name == "Home" and board.state.homing_line:
            self.pending = True
            return
        board.send(self.status())

    def status(self) -> str:
        """Return a status report."""
        board, state = self.board, self.board.state
        held = state.name in ("Hold", "Door")
        name = f"{state.name}:{state.substate}" if held else state.name
        mask = int(state.settings[10])
        offset = state.work_offset()
        here = board.position
        origin, shown = ("MPos", here) if mask & 1 else ("WPos", here - offset)
        fields = [name, f"{origin}:{self.vector(shown)}"]
        if mask & 2:
            fields.append(f"Bf:{BLOCKS - len(state.queue)},{128 - len(state.ring)}")
        fields.append(f"FS:{self._feed()},0")
        fields += self._pins_field() + self._rare_fields(offset)
        return "<" + "|".join(fields) + ">\r\n"

    def _feed(self) -> str:
        state = self.board.state
        speed = state.glide.speed_at(self.board.now) * 60 if state.glide else 0.0
        return f"{speed / INCH_MM:.1f}" if state.settings[13] else f"{speed:.0f}"

    def _pins_field(self) -> list[str]:
        pins = self.pins()
        return [f"Pn:{pins}"] if pins else []

    def _rare_fields(self, offset: np.ndarray) -> list[str]:
        busy = self.board.state.name in BUSY
        fields = []
        if self.offset_due > 0:
            self.offset_due -= 1
        else:
            self.offset_due = 29 if busy else 9
            self.overrides_due = max(self.overrides_due, 1)
            fields.append(f"WCO:{self.vector(offset)}")
        if self.overrides_due > 0:
            self.overrides_due -= 1
        else:
            self.overrides_due = 19 if busy else 9
            fields.append("Ov:" + ",".join(str(value) for value in self.overrides))
        return fields

    def override(self, byte: int) -> None:
        """Take a real-time override; equal bytes at once count as one."""
        wanted = {0x90: (0, 100), 0x95: (1, 100), 0x96: (1, 50), 0x97: (1, 25)}
        if byte in wanted:
            place, value = wanted[byte]
            self.overrides[place] = value
        elif byte in (0x91, 0x92):
            self.overrides[0] = 110 if byte == 0x91 else 90
        self.overrides_due = 0

    def settings(self) -> str:
        """Return the settings report."""
        kept = sorted(self.board.state.settings.items())
        lines = [print_setting(number, value) for number, value in kept]
        return "".join(f"{line}\r\n" for line in lines)

    def parameters(self) -> str:
        """Return the coordinate offsets and the last probe."""
        state = self.board.state
        lines = [f"[{k}:{self.vector(v)}]" for k, v in state.offsets.items()]
        lines.append(f"[G92:{self.vector(state.g92)}]")
        lines += ["[TLO:0.000]", "[PRB:0.000,0.000,0.000:0]"]
        return "".join(f"{line}\r\n" for line in lines)

    def modes(self) -> str:
        """Return the parser state."""
        c = self.board.state.modes
        codes = [c.motion, c.system, c.plane, c.units, c.distance, c.feed_mode]
        tail = f"M5 M9 T{c.tool} F{c.feed:.0f} S0"
        return f"[GC:{' '.join(codes)} {tail}]\r\n"
