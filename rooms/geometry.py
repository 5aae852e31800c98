"""Shapes of rooms: what an effect may ask of any of them."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir.errors import SceneError

__all__ = ["Geometry", "Shoebox"]

FloatArray = NDArray[np.float64]


class Geometry(Protocol):
    """What effects and statistics ask of any shape."""

    @property
    def volume(self) -> float:
        """Volume of the air [m³]."""
        ...

    @property
    def areas(self) -> FloatArray:
        """Area of each surface [m²], shape (surfaces,)."""
        ...

    @property
    def center(self) -> FloatArray:
        """Middle of the room [m], shape (3,)."""
        ...

    @property
    def size(self) -> FloatArray:
        """Lengths of the bounding box [m], shape (3,)."""
        ...

    @property
    def surfaces(self) -> int:
        """Number of surfaces with a material of their own."""
        ...

    def outside(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Tell which points, shape (N, 3), do not lie in the air."""
        ...


@dataclass(frozen=True, eq=False)
class Shoebox:
    """A box with a corner at the origin; its walls are numbered as `rir.room.WALLS`.

    Parameters
    ----------
    size : array_like, shape (3,)
        Lengths along x, y, z [m].
    """

    size: FloatArray

    def __post_init__(self) -> None:
        size = np.array(self.size, dtype=float)
        if size.shape != (3,) or not np.all(np.isfinite(size)) or np.any(size <= 0):
            raise SceneError(f"a shoebox needs three positive lengths, not {self.size}")
        if not (size.min() >= 1e-4 and size.max() <= 1e5):
            raise SceneError(
                f"a shoebox measures 0.1 mm to 100 km each way, not {self.size} m"
            )
        object.__setattr__(self, "size", size)

    @property
    def volume(self) -> float:
        """Volume [m³]."""
        return float(np.prod(self.size))

    @property
    def areas(self) -> FloatArray:
        """Area of each wall [m²], shape (6,)."""
        x, y, z = self.size
        return np.array([y * z, y * z, x * z, x * z, x * y, x * y])

    @property
    def center(self) -> FloatArray:
        """Middle of the room [m], shape (3,)."""
        return self.size / 2

    @property
    def surfaces(self) -> int:
        """Number of surfaces with a material of their own."""
        return 6

    def outside(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Tell which points, shape (N, 3), do not lie in or on the box."""
        points = np.asarray(points, dtype=float)
        slack = 1e-9 * self.size
        return np.any((points < -slack) | (points > self.size + slack), axis=-1)
