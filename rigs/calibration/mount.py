"""How a carried device sits on a machine, and where the machine stands."""

from dataclasses import dataclass, field

from rigs.calibration.frame import Frame

AXES = ("x", "y", "z", "yaw")
FIXED_TOLERANCE = {"x": 1.0, "y": 1.0, "z": 1.0, "yaw": 1.0}
"""How far an axis that cannot move may be from what a pose asks, mm or degrees."""


@dataclass(frozen=True, eq=False)
class Mount:
    """How the carried device sits on the machine."""

    frame: Frame = field(default_factory=Frame)
    """From machine to room."""
    fixed: dict[str, float] = field(default_factory=dict)
    """Machine positions of the axes nothing moves, mm and degrees."""
    free_orientation: bool = False
    """Whether the device is turned by hand or has no preferred direction, so that any
    orientation asked for is taken as given."""
