"""Rigs on one Marlin board."""

from collections.abc import Callable
from functools import partial
from typing import Literal

from pydantic import Field

from rigs.faulty import suffer
from rigs.firmware.marlin import MarlinFirmware
from rigs.line import SerialLine
from rigs.machine import MachineRig
from rigs.marlin_controller import MarlinController, MarlinOptions
from rigs.ports import SIMULATED, simulated_line
from rigs.rig import RIGS, RigKind, Surroundings
from rigs.words import FaultConfig, MachineConfig, Triple
from rir.config import Config


class MarlinSimulation(Config):
    """How a simulated Marlin board is set up."""

    at_mm: Triple = (50.0, 50.0, 50.0)
    faults: tuple[FaultConfig, ...] = ()


class MarlinPart(Config):
    """One Marlin board, on its own or as part of a composite rig."""

    kind: Literal["marlin"] = "marlin"
    port: str
    baud: int = 250000
    board: MarlinOptions = MarlinOptions()
    simulation: MarlinSimulation = Field(default_factory=MarlinSimulation)

    @property
    def simulated(self) -> bool:
        """Whether a firmware model takes the place of a board."""
        return self.port == SIMULATED

    def controller(
        self, around: Surroundings
    ) -> tuple[MarlinController, Callable[[], dict[str, float]] | None]:
        """Return the driver, and the truth about its axes if it is simulated."""
        if not self.simulated:
            line = SerialLine(self.port, self.baud, around.clock)
            return MarlinController(line, around.clock, self.board), None
        x, y, z = (*self.board.high_mm, 0.0, 0.0)[:3]
        chip = MarlinFirmware(self.simulation.at_mm, (x, y, z))
        for fault in self.simulation.faults:
            chip.on_move.append(partial(suffer, chip, fault))
        line = simulated_line(chip, around.clock)
        driver = MarlinController(line, around.clock, self.board, simulated=True)

        def truth() -> dict[str, float]:
            values = (float(value) for value in chip.true_position)
            return dict(zip(self.board.axes, values, strict=False))

        return driver, truth


class MarlinConfig(MachineConfig, MarlinPart):
    """The part of a rig file that describes a rig on one Marlin board."""


def _build(config: MarlinConfig, around: Surroundings) -> MachineRig:
    driver, truth = config.controller(around)
    envelope = config.envelope.envelope()
    return MachineRig(
        config.name, "marlin", [driver], envelope, config.mount(), around, truth
    )


RIGS.add("marlin")(RigKind("a gantry on a Marlin board", MarlinConfig, _build))
