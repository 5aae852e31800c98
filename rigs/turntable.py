"""Rigs that only turn, or move one axis, by a dialogue described in the rig file."""

from collections.abc import Callable
from typing import Literal

from rigs.dialogue_controller import DialogueController, DialogueOptions
from rigs.firmware.turntable import TurntableFirmware
from rigs.line import SerialLine
from rigs.machine import MachineRig
from rigs.ports import SIMULATED, simulated_line
from rigs.rig import RIGS, RigKind, Surroundings
from rigs.words import MachineConfig
from rir.config import Config


class TurntablePart(Config):
    """One simple controller, on its own or as part of a composite rig."""

    kind: Literal["turntable"] = "turntable"
    port: str
    baud: int = 9600
    stage: DialogueOptions

    @property
    def simulated(self) -> bool:
        """Whether a model takes the place of a turntable."""
        return self.port == SIMULATED

    def controller(
        self, around: Surroundings
    ) -> tuple[DialogueController, Callable[[], dict[str, float]] | None]:
        """Return the driver, and the truth about its axis if it is simulated."""
        if not self.simulated:
            line = SerialLine(self.port, self.baud, around.clock)
            return DialogueController(line, around.clock, self.stage), None
        dialogue = self.stage.dialogue
        silent = dialogue.done is None and dialogue.poll is None
        chip = TurntableFirmware(
            0.0 if dialogue.home is None else 30.0,
            speed=self.stage.speed,
            silent=silent,
        )
        line = simulated_line(chip, around.clock)
        driver = DialogueController(line, around.clock, self.stage, simulated=True)
        return driver, lambda: {self.stage.axis: float(chip.true_position[0])}


class TurntableConfig(MachineConfig, TurntablePart):
    """The part of a rig file that describes a turntable or a single stage."""


def _build(config: TurntableConfig, around: Surroundings) -> MachineRig:
    driver, truth = config.controller(around)
    envelope = config.envelope.envelope()
    return MachineRig(
        config.name, "turntable", [driver], envelope, config.mount(), around, truth
    )


RIGS.add("turntable")(
    RigKind("a turntable or stage with a described dialogue", TurntableConfig, _build)
)
