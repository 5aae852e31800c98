"""Shapes of rooms: what an effect may ask of any of them."""

from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir.arrays import FloatArray
from rir.errors import SceneError

if TYPE_CHECKING:
    from rooms.mesh import MeshGeometry

__all__ = ["Geometry", "Shoebox"]


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

    @property
    def surface_names(self) -> tuple[str, ...]:
        """Names that came with the surfaces; none for a box, see `rir.room.WALLS`."""
        ...

    @property
    def report(self) -> tuple[str, ...]:
        """What was repaired in the shape, and what was left open."""
        ...

    @property
    def estimates(self) -> tuple[str, ...]:
        """What is known only about, in words: the size of a shape that is open."""
        ...

    @property
    def volume_error(self) -> float:
        """Standard error of the volume [m³]; 0 where surfaces enclose it."""
        ...

    @property
    def open_share(self) -> float:
        """Share of the directions from points in the room that meet no surface."""
        ...

    @property
    def lattice(self) -> bool:
        """Whether images form a lattice, so that closed forms hold: a box alone."""
        ...

    @property
    def convex(self) -> bool:
        """Whether every two points of the room see each other."""
        ...

    @property
    def watertight(self) -> bool:
        """Whether the surfaces enclose the air."""
        ...

    @property
    def mesh(self) -> "MeshGeometry":
        """The same shape as triangles, whose surfaces are numbered alike."""
        ...

    def outside(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Tell which points, shape (N, 3), do not lie in the air."""
        ...

    def facing(self) -> FloatArray:
        """Return how much of each wall of a box each surface is, (6, surfaces)."""
        ...


@dataclass(frozen=True, eq=False)
class Shoebox:
    """A box with a corner at the origin; its walls are numbered as `rir.room.WALLS`."""

    size: FloatArray
    """Lengths along x, y, z [m]. Shape (3,)."""
    surface_names: tuple[str, ...] = field(default=(), init=False)
    report: tuple[str, ...] = field(default=(), init=False)
    estimates: tuple[str, ...] = field(default=(), init=False)
    open_share: float = field(default=0.0, init=False)
    volume_error: float = field(default=0.0, init=False)
    lattice: bool = field(default=True, init=False)
    convex: bool = field(default=True, init=False)
    watertight: bool = field(default=True, init=False)

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

    @property
    def mesh(self) -> "MeshGeometry":
        """The box as twelve triangles."""
        return _box_mesh(self)

    def facing(self) -> FloatArray:
        """Return how much of each wall each surface is: all of its own."""
        return np.eye(6)


@lru_cache(maxsize=8)
def _box_mesh(box: Shoebox) -> "MeshGeometry":
    from rooms.mesh import MeshGeometry

    return MeshGeometry.box(box.size)
