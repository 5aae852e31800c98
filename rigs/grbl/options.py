"""What a rig file says about a Grbl or grblHAL board."""

from pydantic import Field

from rir.config import StrictModel


class GrblOptions(StrictModel):
    """Options of one board; travel, speeds and homing are read from the board."""

    axes: tuple[str, ...] = ("x", "y", "z")
    """What its X, Y and Z move: any of x, y, z, yaw."""
    feed_mm_per_min: float = Field(default=3000.0, gt=0)
    """Feed of the moves; the board's own limits still hold."""
    low_mm: tuple[float, ...] | None = None
    """Lowest machine position of each axis; the board's travel when left out."""
    high_mm: tuple[float, ...] | None = None
    expect: dict[int, float] = Field(default_factory=dict)
    """``$`` settings the board must have, as 130: 200."""
    tolerance_mm: float = Field(default=0.02, gt=0)
    """Largest accepted distance between target and position."""
    stray_mm: float = Field(default=1.0, gt=0)
    """Largest accepted distance from the straight way while moving."""
    settle_s: float = Field(default=1.0, ge=0)
    """Waited after each arrival."""
    homing_s: float | None = None
    """Time allowed for homing; computed from the board's settings when left out."""
    retries: int = Field(default=1, ge=0)
    """Attempts to go on after a disturbed line, with the position still known."""
    stamp: bool = True
    """Mark the homed state by a G92 offset, which dies with any reset."""
    reference: bool = False
    """Feel for the switches after homing, so that `confirm` can find lost steps.

    Needs hard limits off ($21=0) and homing towards + ($23=0)."""
    reference_mm: float = Field(default=0.1, gt=0)
    """Largest drift `confirm` accepts."""
    quiet: tuple[str, ...] = ()
    """Lines sent before each recording, as M9."""
    loud: tuple[str, ...] = ()
    """Lines sent after it."""
