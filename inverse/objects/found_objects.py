"""What was found in a room besides its walls, for plans and reports."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from inverse.bands.banded_room import BandedRoom
from rir.arrays import FloatArray

__all__ = ["FoundObjects"]

STATED_HZ = 1000.0  # gains are stated at the middle octave of ISO 3382-1


@dataclass(frozen=True, eq=False)
class FoundObjects:
    """Hold small objects and blocks of a room."""

    points: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    """Small objects, metres. Shape (points, 3)."""
    gains: FloatArray = field(default_factory=lambda: np.zeros(0))
    """Their amplitude at 1 m at 1 kHz, metres. Shape (points,)."""
    squares: FloatArray = field(default_factory=lambda: np.zeros((0, 4, 2)))
    """Voxels in the way of sound, from above. Shape (n, 4, 2)."""
    blocks: list[dict[str, Any]] = field(default_factory=list)
    """Corner, three edges and level of each block of voxels."""

    def __bool__(self) -> bool:
        return len(self.points) > 0 or len(self.squares) > 0

    def as_dict(self) -> dict[str, Any]:
        """Return plain values."""
        return {
            "points": self.points.tolist(),
            "point_gains_m": self.gains.tolist(),
            "blocks": self.blocks,
        }

    @classmethod
    def of(cls, banded: BandedRoom | None) -> "FoundObjects":
        """Return what a room holds; nothing where half octaves were not fitted."""
        if banded is None:
            return cls()
        found: dict[str, Any] = {}
        if banded.scatterers is not None:
            band = int(np.argmin(np.abs(np.log(banded.grid.centers / STATED_HZ))))
            found["points"] = banded.scatterers.points
            found["gains"] = np.abs(banded.scatterers.gains[band])
        if banded.occluders is not None:
            found["squares"] = _squares(banded)
            found["blocks"] = _blocks(banded)
        return cls(**found)


def _squares(banded: BandedRoom) -> FloatArray:
    """Return the outlines of columns of voxels that hold a solid one."""
    occluders, box = banded.occluders, banded.room.box
    if occluders is None:
        return np.zeros((0, 4, 2))
    step = (box.high - box.low) / occluders.shape
    columns = np.argwhere(occluders.solid.any(axis=2))
    corners = columns[:, None] + np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    inside = np.zeros((len(columns), 4, 3))
    inside[..., :2] = box.low[:2] + corners * step[:2]
    return (inside @ box.axes + box.origin)[..., :2]


def _blocks(banded: BandedRoom) -> list[dict[str, Any]]:
    occluders, box = banded.occluders, banded.room.box
    if occluders is None:
        return []
    return [
        {
            "corner": (low @ box.axes + box.origin).tolist(),
            "edges": ((high - low)[:, None] * box.axes).tolist(),
        }
        for low, high in occluders.blocks(box)
    ]
