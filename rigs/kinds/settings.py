"""The parts of a rig file that several kinds of rig share."""

from typing import Literal

import numpy as np
from pydantic import Field

from rigs.calibration.frame import Frame
from rigs.calibration.mount import Mount
from rigs.planning.envelope import Envelope, KeepOut
from rir.config import StrictModel

Triple = tuple[float, float, float]


class BoxConfig(StrictModel):
    """A keep-out box in room metres."""

    name: str
    low_m: Triple
    high_m: Triple


class EnvelopeConfig(StrictModel):
    """Reach, keep-outs and size of the carried device, in room metres."""

    low_m: Triple
    high_m: Triple
    keep_outs: tuple[BoxConfig, ...] = ()
    clearance_m: float = Field(default=0.0, ge=0.0)
    column: Literal["none", "up", "down"] = "none"

    def envelope(self) -> Envelope:
        """Return the envelope described."""
        boxes = tuple(KeepOut(b.name, b.low_m, b.high_m) for b in self.keep_outs)
        return Envelope(self.low_m, self.high_m, boxes, self.clearance_m, self.column)


class FrameConfig(StrictModel):
    """Where the machine's zero lies in the room, as `rig survey` prints it."""

    origin_m: Triple = (0.0, 0.0, 0.0)
    yaw_deg: float = 0.0
    orientation: tuple[float, float, float, float] | None = None
    """Full quaternion, scalar last; takes the place of the yaw."""

    def frame(self) -> Frame:
        """Return the frame described."""
        if self.orientation is None:
            return Frame.at(self.origin_m, self.yaw_deg)
        quaternion = np.array(self.orientation)
        return Frame(np.array(self.origin_m), quaternion / np.linalg.norm(quaternion))


class MachineConfig(StrictModel):
    """What every rig made of controllers needs to know about the room."""

    name: str = "rig"
    envelope: EnvelopeConfig
    frame: FrameConfig = FrameConfig()
    fixed: dict[Literal["x", "y", "z", "yaw"], float] = Field(default_factory=dict)
    """Machine positions of the axes nothing moves, mm and degrees."""
    free_orientation: bool = False
    """Take any orientation as given: turned by hand, or without a direction."""

    def mount(self) -> Mount:
        """Return how the device sits on the machine."""
        fixed = {str(axis): value for axis, value in self.fixed.items()}
        return Mount(self.frame.frame(), fixed, self.free_orientation)


class FaultConfig(StrictModel):
    """A fault a simulated board suffers in mid-move."""

    kind: Literal["brown-out", "lost-steps", "garbage", "mute", "delay", "unplug"]
    at_move: int = Field(ge=1)
    """Number of the straight move it happens in, counted from power-up."""
    after_s: float = Field(default=0.3, ge=0)
    """Seconds into that move."""
    seconds: float = Field(default=1.0, ge=0)
    millimetres: Triple = (0.0, 0.0, 0.0)


class SimulatedBoardConfig(StrictModel):
    """How a simulated board behind ``port: simulated`` is set up."""

    at_mm: Triple = (-100.0, -100.0, -100.0)
    """True machine position at power-up."""
    settings: dict[int, float] = Field(default_factory=dict)
    """Settings of the board that differ from the usual ones."""
    faults: tuple[FaultConfig, ...] = ()
