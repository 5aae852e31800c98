"""Where seats are: level panels of surfaces that stand for rows of them."""

import numpy as np

from rir.arrays import BoolArray, FloatArray
from rir.seats import SeatRows
from rooms.scene import Scene

__all__ = ["LEAST_ROWS", "seat_floors", "seat_panels", "tops_above"]

LEAST_ROWS = 4
"""Rows below which seats are pieces of furniture, not a plane: a bench, a sofa."""

_LEVEL = 0.7
"""Least upward part of a normal: seats stand on floors and rakes up to 45°."""

_FLOOR = 4
"""Wall of a box that seats stand on, see `rir.room.WALLS`."""


def seat_panels(scene: Scene) -> BoolArray:
    """Tell which panels are areas of seats: marked, level, and some rows long."""
    seats = scene.seats or (None,) * scene.geometry.surfaces
    if scene.geometry.lattice:
        across = float(np.hypot(*scene.geometry.size[:2]))
        walls = [
            wall == _FLOOR and _long(rows, across) for wall, rows in enumerate(seats)
        ]
        return np.array(walls)
    mesh = scene.geometry.mesh
    panels = mesh.panels
    found = np.zeros(len(panels), dtype=bool)
    for surface, rows in enumerate(seats):
        for panel in np.unique(panels.of_face[mesh.face_surface == surface]):
            level = abs(panels.normal[panel, 2]) > _LEVEL
            found[panel] |= level and _long(rows, 2 * float(panels.radius[panel]))
    return found


def _long(rows: SeatRows | None, length: float) -> bool:
    return rows is not None and length >= LEAST_ROWS * rows.row_m


def seat_floors(scene: Scene) -> tuple[FloatArray, FloatArray]:
    """Return triangles of floors under areas of seats, and how far the tops rise.

    Returns
    -------
    floors : ndarray, shape (triangles, 3, 3)
        Corners [m].
    lifts : ndarray, shape (triangles,)
        Height of the tops above each [m].
    """
    mesh = scene.geometry.mesh
    boxed = scene.geometry.lattice
    panel = mesh.face_surface if boxed else mesh.panels.of_face
    lift = np.array(
        [0.0 if rows is None else tops_above(scene, rows) for rows in scene.seats]
    )
    lifts = lift[mesh.face_surface]
    under = seat_panels(scene)[panel] & (lifts > 0)
    return mesh.corners[under] + mesh.origin, lifts[under]


def tops_above(scene: Scene, rows: SeatRows) -> float:
    """Return how far the tops of seats lie above the surface for them [m]."""
    drawn_at = rows.drawn_at
    if drawn_at is None:
        drawn_at = "floor" if scene.geometry.lattice else "tops"
    return rows.back_m if drawn_at == "floor" else 0.0
