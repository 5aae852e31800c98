"""The parts of a rig file that several kinds of rig share."""

from pydantic import Field

from rigs.envelope import Envelope, KeepOut
from rir.config import Config

Triple = tuple[float, float, float]


class BoxConfig(Config):
    """A keep-out box in room metres."""

    name: str
    low_m: Triple
    high_m: Triple


class EnvelopeConfig(Config):
    """Reach, keep-outs and size of the carried device, in room metres."""

    low_m: Triple
    high_m: Triple
    keep_outs: tuple[BoxConfig, ...] = ()
    clearance_m: float = Field(default=0.0, ge=0.0)

    def envelope(self) -> Envelope:
        """Return the envelope described."""
        boxes = tuple(KeepOut(b.name, b.low_m, b.high_m) for b in self.keep_outs)
        return Envelope(self.low_m, self.high_m, boxes, self.clearance_m)
