"""Rigs that only turn, or move one axis, by a dialogue described in the rig file."""

from typing import Literal

from rigs.clock import Clock
from rigs.dialogue.controller import DialogueController, DialogueOptions
from rigs.firmware.turntable import TurntableFirmware
from rigs.kinds.part import ControllerPart, PartConfig, add_machine
from rigs.lines.serial import Line


class TurntablePart(ControllerPart):
    """One simple controller, on its own or as part of a composite rig."""

    kind: Literal["turntable"] = "turntable"
    baud: int = 9600
    stage: DialogueOptions

    @property
    def axes(self) -> tuple[str, ...]:
        """The axis it moves."""
        return (self.stage.axis,)

    def driver(self, line: Line, clock: Clock) -> DialogueController:
        """Return the driver that speaks over a line."""
        return DialogueController(line, clock, self.stage, simulated=self.simulated)

    def model(self) -> TurntableFirmware:
        """Return the firmware model that takes the place of a turntable."""
        dialogue = self.stage.dialogue
        silent = dialogue.done is None and dialogue.poll is None
        at = 0.0 if dialogue.home is None else 30.0
        return TurntableFirmware(at, speed=self.stage.speed, silent=silent)


class TurntableConfig(TurntablePart, PartConfig):
    """The part of a rig file that describes a turntable or a single stage."""


add_machine(
    "turntable", "a turntable or stage with a described dialogue", TurntableConfig
)
