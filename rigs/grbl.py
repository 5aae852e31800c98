"""Rigs on one Grbl 1.1 or grblHAL board."""

from collections.abc import Callable
from functools import partial
from typing import Literal

from rigs.faulty import suffer
from rigs.firmware.grbl import GrblFirmware
from rigs.grbl_controller import GrblController
from rigs.grbl_options import GrblOptions
from rigs.line import SerialLine
from rigs.machine import MachineRig
from rigs.ports import SIMULATED, simulated_line
from rigs.rig import RIGS, RigKind, Surroundings
from rigs.words import MachineConfig, SimulationConfig
from rir.config import Config

USUAL_SETTINGS = {
    20: 1, 22: 1, 24: 200, 25: 1500, 27: 2, 110: 6000, 111: 6000, 112: 6000,
    120: 200, 121: 200, 122: 200, 130: 3000, 131: 3000, 132: 2000,
}  # fmt: skip
"""Settings of a simulated gantry the size of a room, where a rig file says nothing."""


class GrblPart(Config):
    """One board, on its own or as part of a composite rig."""

    kind: Literal["grbl"] = "grbl"
    port: str
    """Port or URL, or ``simulated``."""
    baud: int = 115200
    board: GrblOptions = GrblOptions()
    simulation: SimulationConfig = SimulationConfig()

    @property
    def simulated(self) -> bool:
        """Whether a firmware model takes the place of a board."""
        return self.port == SIMULATED

    def controller(
        self, around: Surroundings
    ) -> tuple[GrblController, Callable[[], dict[str, float]] | None]:
        """Return the driver, and the truth about its axes if it is simulated."""
        if not self.simulated:
            line = SerialLine(self.port, self.baud, around.clock)
            return GrblController(line, around.clock, self.board), None
        chip = GrblFirmware(
            USUAL_SETTINGS | self.simulation.settings, at=self.simulation.at_mm
        )
        for fault in self.simulation.faults:
            chip.on_move.append(partial(suffer, chip, fault))
        line = simulated_line(chip, around.clock)
        driver = GrblController(line, around.clock, self.board, simulated=True)

        def truth() -> dict[str, float]:
            values = (float(value) for value in chip.true_position)
            return dict(zip(self.board.axes, values, strict=False))

        return driver, truth


class GrblConfig(MachineConfig, GrblPart):
    """The part of a rig file that describes a rig on one Grbl board."""


def _build(config: GrblConfig, around: Surroundings) -> MachineRig:
    driver, truth = config.controller(around)
    envelope = config.envelope.envelope()
    return MachineRig(
        config.name, "grbl", [driver], envelope, config.mount(), around, truth
    )


RIGS.add("grbl")(RigKind("a gantry on a Grbl 1.1 or grblHAL board", GrblConfig, _build))
