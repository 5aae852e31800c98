"""The walls of a room as somebody described it, to compare with those found."""

import numpy as np
from numpy.typing import NDArray

from rir import Dataset, RoomSpec

__all__ = ["box_triangles", "described_walls"]


def described_walls(dataset: Dataset) -> NDArray[np.float64]:
    """Return triangles of the box that a data set says it was taken in, (T, 3, 3).

    None where several rooms, or none, are described.
    """
    rooms = [room for room in dataset.rooms if room is not None]
    return box_triangles(rooms[0] if len(rooms) == 1 else None)


def box_triangles(room: RoomSpec | None) -> NDArray[np.float64]:
    """Return triangles of a room's box, shape (T, 3, 3), metres; none without one."""
    if room is None:
        return np.empty((0, 3, 3))
    from rooms.mesh import MeshGeometry

    box = MeshGeometry.box(room.size_m)
    return box.corners + box.origin
