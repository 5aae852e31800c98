"""Rigs on one Marlin board."""

from typing import Literal

from pydantic import Field

from rigs.clock import Clock
from rigs.firmware.marlin import MarlinFirmware
from rigs.kinds.part import ControllerPart, PartConfig, add_machine, plagued
from rigs.kinds.settings import FaultConfig, Triple
from rigs.lines.serial import Line
from rigs.marlin.controller import MarlinController, MarlinOptions
from rir.config import StrictModel


class MarlinSimulation(StrictModel):
    """How a simulated Marlin board is set up."""

    at_mm: Triple = (50.0, 50.0, 50.0)
    faults: tuple[FaultConfig, ...] = ()


class MarlinPart(ControllerPart):
    """One Marlin board, on its own or as part of a composite rig."""

    kind: Literal["marlin"] = "marlin"
    baud: int = 250000
    board: MarlinOptions = MarlinOptions()
    simulation: MarlinSimulation = Field(default_factory=MarlinSimulation)

    @property
    def axes(self) -> tuple[str, ...]:
        """The axes it moves."""
        return self.board.axes

    def driver(self, line: Line, clock: Clock) -> MarlinController:
        """Return the driver that speaks over a line."""
        return MarlinController(line, clock, self.board, simulated=self.simulated)

    def model(self) -> MarlinFirmware:
        """Return the firmware model that takes the place of a board."""
        x, y, z = (*self.board.high_mm, 0.0, 0.0)[:3]
        chip = MarlinFirmware(self.simulation.at_mm, (x, y, z))
        return plagued(chip, self.simulation.faults)


class MarlinConfig(MarlinPart, PartConfig):
    """The part of a rig file that describes a rig on one Marlin board."""


add_machine("marlin", "a gantry on a Marlin board", MarlinConfig)
