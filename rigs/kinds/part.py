"""Controllers from rig files: a driver on a real line or on a firmware model."""

from abc import abstractmethod
from collections.abc import Callable
from functools import partial
from typing import TypeVar

from rigs.clock import Clock
from rigs.controller import Controller
from rigs.firmware.chip import Chip
from rigs.kinds.faulty import SimulatedBoard, suffer
from rigs.kinds.settings import FaultConfig, MachineConfig
from rigs.lines.serial import Line, SerialLine
from rigs.lines.simulated import SIMULATED, simulated_line
from rigs.machine import MachineRig
from rigs.rig import RIGS, RigKind, Surroundings
from rir.config import StrictModel

Truth = Callable[[], dict[str, float]]
"""The true machine position of each axis of a simulated controller."""


B = TypeVar("B", bound=SimulatedBoard)


class ControllerPart(StrictModel):
    """One controller behind a port, on its own or as part of a composite rig."""

    port: str
    """Port or URL, or ``simulated``."""
    baud: int

    @property
    def simulated(self) -> bool:
        """Whether a firmware model takes the place of a device."""
        return self.port == SIMULATED

    @property
    @abstractmethod
    def axes(self) -> tuple[str, ...]:
        """The axes it moves."""

    @abstractmethod
    def driver(self, line: Line, clock: Clock) -> Controller:
        """Return the driver that speaks over a line."""

    @abstractmethod
    def model(self) -> Chip:
        """Return the firmware model that takes the place of a device."""

    def controller(self, around: Surroundings) -> tuple[Controller, Truth | None]:
        """Return the driver, and the truth about its axes if it is simulated."""
        clock = around.clock
        if not self.simulated:
            return self.driver(SerialLine(self.port, self.baud, clock), clock), None
        chip = self.model()
        truth = partial(_truth, self.axes, chip)
        return self.driver(simulated_line(chip, clock), clock), truth


def _truth(axes: tuple[str, ...], chip: Chip) -> dict[str, float]:
    values = (float(value) for value in chip.true_position)
    return dict(zip(axes, values, strict=False))


def plagued(chip: B, faults: tuple[FaultConfig, ...]) -> B:
    """Let a firmware model suffer the faults a rig file asks for, and return it."""
    for fault in faults:
        chip.on_move.append(partial(suffer, chip, fault))
    return chip


class PartConfig(MachineConfig, ControllerPart):
    """The part of a rig file that describes a rig of one controller."""


def add_machine(name: str, about: str, config: type[PartConfig]) -> None:
    """Put a kind of rig that has one controller into the table."""

    def build(config: PartConfig, around: Surroundings) -> MachineRig:
        driver, truth = config.controller(around)
        envelope, mount = config.envelope.envelope(), config.mount()
        return MachineRig(config.name, name, [driver], envelope, mount, around, truth)

    RIGS.add(name)(RigKind(about, config, build))
