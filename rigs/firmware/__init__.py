"""Firmware models: they answer like real motion controllers and move in time."""

from rigs.firmware.chip import Chip
from rigs.firmware.direct import DirectLine
from rigs.firmware.grbl import GrblFirmware
from rigs.firmware.pty import PseudoTerminal

__all__ = ["Chip", "DirectLine", "GrblFirmware", "PseudoTerminal"]
