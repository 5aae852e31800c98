"""The walls of a box-shaped room in any attitude."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray

__all__ = ["FAR_M", "OrientedBox"]

FAR_M = 500.0  # stands for a wall that was not heard: beyond any path that is listed


@dataclass(frozen=True, eq=False)
class OrientedBox:
    """Hold the walls of a box.

    Parameters
    ----------
    axes : ndarray, shape (3, 3)
        Rows are the box's axes in the room's coordinates.
    origin : ndarray, shape (3,)
        A point inside, from which the walls are measured.
    low, high : ndarray, shape (3,)
        Walls along each axis, relative to the origin; `FAR_M` away where no
        wall was found.
    z : ndarray, shape (6,)
        How clearly each wall was found (low x, high x, low y, ...); 0 if not.
    """

    axes: FloatArray
    origin: FloatArray
    low: FloatArray
    high: FloatArray
    z: FloatArray

    @property
    def planes(self) -> FloatArray:
        """Normals into the room and offsets, shape (6, 4)."""
        rows = []
        for axis in range(3):
            middle = float(self.axes[axis] @ self.origin)
            rows.append(np.append(self.axes[axis], middle + self.low[axis]))
            rows.append(np.append(-self.axes[axis], -middle - self.high[axis]))
        return np.array(rows)

    @property
    def found(self) -> NDArray[np.bool_]:
        """Whether each of the six walls was found."""
        walls = np.stack([-self.low, self.high], axis=1).ravel()
        return walls < 0.5 * FAR_M

    def with_wall(self, wall: int, offset: float | None, z: float) -> "OrientedBox":
        """Return the box with one wall at its plane's offset, or not found."""
        low, high, scores = self.low.copy(), self.high.copy(), self.z.copy()
        axis, upper = divmod(wall, 2)
        middle = float(self.axes[axis] @ self.origin)
        scores[wall] = z
        if upper:
            high[axis] = FAR_M if offset is None else -offset - middle
        else:
            low[axis] = -FAR_M if offset is None else offset - middle
        return replace(self, low=low, high=high, z=scores)

    def without_walls(self) -> "OrientedBox":
        """Return the box with no wall found."""
        far = np.full(3, FAR_M)
        return replace(self, low=-far, high=far, z=np.zeros(6))

    def inside(self, positions: FloatArray) -> FloatArray:
        """Return positions in the frame of the box, relative to its origin."""
        return (positions - self.origin) @ self.axes.T

    def turned(self, turn: FloatArray) -> "OrientedBox":
        """Return the box turned by a small rotation vector in its own frame."""
        from scipy.spatial.transform import Rotation

        # poses move by +turn in the frame, so the axes move by its inverse
        axes = Rotation.from_rotvec(turn).as_matrix() @ self.axes
        return replace(self, axes=axes)
