"""Furniture of a box-shaped room: boxes with faces of their own."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir.arrays import FloatArray
from rir.errors import SceneError
from rir.room import WALLS, RoomSpec

if TYPE_CHECKING:
    from rooms.mesh import MeshGeometry

__all__ = ["Furniture", "furnished_mesh"]


@dataclass(frozen=True, eq=False)
class Furniture:
    """Boxes that stand in a room, axis-aligned.

    Parameters
    ----------
    names : tuple of str
        What each piece is called.
    low, high : ndarray, shape (pieces, 3)
        Its corners [m].
    absorption, scattering, transmission : ndarray, shape (pieces, bands)
        Shares of the energy that arrives at its faces; transmission is the share that
        passes the whole piece.
    assumed : tuple of bool
        Whether its material was not stated.

    Raises
    ------
    SceneError
        If a piece lets through more than two faces that absorb so much can.
    """

    names: tuple[str, ...]
    low: FloatArray
    high: FloatArray
    absorption: FloatArray
    scattering: FloatArray
    transmission: FloatArray
    assumed: tuple[bool, ...]

    def __post_init__(self) -> None:
        through = np.sqrt(self.transmission) > self.absorption + 1e-12
        if np.any(through):
            name = self.names[int(np.argmax(through.any(axis=1)))]
            raise SceneError(
                f"{name} lets through more than its faces take in: its transmission"
                " is at most the square of its absorption, as sound crosses two faces"
            )

    def __len__(self) -> int:
        return len(self.names)

    @staticmethod
    def of(room: RoomSpec) -> "Furniture | None":
        """Return the furniture of a room, None where there is none."""
        boxes = room.furniture
        if not boxes:
            return None
        faces = [box.surface for box in boxes]
        return Furniture(
            _told_apart([box.name for box in boxes]),
            np.array([box.low for box in boxes]),
            np.array([box.high for box in boxes]),
            np.array([face.absorption_per_band for face in faces]),
            np.array([room.scattering_of(face) for face in faces]),
            np.array([face.transmission_per_band for face in faces]),
            tuple(box.assumed for box in boxes),
        )

    def holds(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Tell which points, shape (N, 3), lie inside a piece, not on its faces."""
        p = np.asarray(points, dtype=float).reshape(-1, 1, 3)
        slack = 1e-9 * np.max(self.high - self.low)
        inside = (p > self.low + slack) & (p < self.high - slack)
        return np.any(np.all(inside, axis=-1), axis=-1).reshape(-1)

    def cuts(self, a: ArrayLike, b: ArrayLike) -> NDArray[np.bool_]:
        """Tell which pieces cut the ways from `a` to `b`, (N, 3): (N, pieces).

        Ways that graze a face are not cut.

        Examples
        --------
        >>> from rir import RoomSpec
        >>> walls = {"all": {"absorption": 0.2}}
        >>> desk = {"low": (1, 1, 0), "high": (2, 2, 1)}
        >>> size = (4, 3, 2)
        >>> room = RoomSpec(name="r", size_m=size, surfaces=walls, furniture=[desk])
        >>> Furniture.of(room).cuts([[0.5, 1.5, 0.5]], [[3, 1.5, 0.5]]).tolist()
        [[True]]
        """
        start = np.asarray(a, dtype=float).reshape(-1, 1, 3)
        way = np.asarray(b, dtype=float).reshape(-1, 1, 3) - start
        with np.errstate(divide="ignore", invalid="ignore"):
            near = (self.low - start) / way
            far = (self.high - start) / way
        # along a face there is no crossing: nowhere, or everywhere between
        still = way == 0
        between = (start > self.low) & (start < self.high)
        enter = np.where(still, np.where(between, -np.inf, np.inf), np.fmin(near, far))
        leave = np.where(still, np.where(between, np.inf, -np.inf), np.fmax(near, far))
        first = np.maximum(enter.max(axis=-1), 0.0)
        last = np.minimum(leave.min(axis=-1), 1.0)
        return last - first > 1e-9

    def mesh(self, size: FloatArray) -> "MeshGeometry":
        """Return a room of a size [m] with the pieces in it.

        Its surfaces are called as the walls and the pieces; what no air touches is
        left out.
        """
        from rooms.mesh import MeshGeometry
        from rooms.mesh.blocks import box_with_blocks

        vertices, faces, owner = box_with_blocks(size, self.low, self.high)
        names = np.array([*WALLS, *self.names])[owner]
        return MeshGeometry.from_arrays(vertices, faces, names.tolist())


def _told_apart(names: Sequence[str]) -> tuple[str, ...]:
    """Return names of which none stands twice, nor is that of a wall.

    Examples
    --------
    >>> _told_apart(["desk", "floor", "desk"])
    ('desk', 'floor (2)', 'desk (2)')
    """
    told: list[str] = []
    for name in names:
        count, free = 1, name
        while free in (*WALLS, *told):
            count += 1
            free = f"{name} ({count})"
        told.append(free)
    return tuple(told)


@lru_cache(maxsize=8)
def furnished_mesh(
    pieces: Furniture, size: tuple[float, float, float]
) -> "MeshGeometry":
    """Return the mesh of a box with its furniture, made once."""
    return pieces.mesh(np.array(size))
