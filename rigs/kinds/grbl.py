"""Rigs on one Grbl 1.1 or grblHAL board."""

from typing import Literal

from rigs.clock import Clock
from rigs.firmware.grbl.firmware import GrblFirmware
from rigs.grbl.controller import GrblController
from rigs.grbl.options import GrblOptions
from rigs.kinds.part import ControllerPart, PartConfig, add_machine, plagued
from rigs.kinds.settings import SimulatedBoardConfig
from rigs.lines.serial import Line

USUAL_SETTINGS = {
    20: 1, 22: 1, 24: 200, 25: 1500, 27: 2, 110: 6000, 111: 6000, 112: 6000,
    120: 200, 121: 200, 122: 200, 130: 3000, 131: 3000, 132: 2000,
}  # fmt: skip
"""Settings of a simulated gantry the size of a room, where a rig file says nothing."""


class GrblPart(ControllerPart):
    """One board, on its own or as part of a composite rig."""

    kind: Literal["grbl"] = "grbl"
    baud: int = 115200
    board: GrblOptions = GrblOptions()
    simulation: SimulatedBoardConfig = SimulatedBoardConfig()

    @property
    def axes(self) -> tuple[str, ...]:
        """The axes it moves."""
        return self.board.axes

    def driver(self, line: Line, clock: Clock) -> GrblController:
        """Return the driver that speaks over a line."""
        return GrblController(line, clock, self.board, simulated=self.simulated)

    def model(self) -> GrblFirmware:
        """Return the firmware model that takes the place of a board."""
        settings = USUAL_SETTINGS | self.simulation.settings
        chip = GrblFirmware(settings, at=self.simulation.at_mm)
        return plagued(chip, self.simulation.faults)


class GrblConfig(GrblPart, PartConfig):
    """The part of a rig file that describes a rig on one Grbl board."""


add_machine("grbl", "a gantry on a Grbl 1.1 or grblHAL board", GrblConfig)
