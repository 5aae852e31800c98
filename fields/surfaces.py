"""Points on the surfaces of a scene, from its room or from the poses' hull."""

import numpy as np

from rir import RoomSpec

__all__ = ["HULL_MARGIN_M", "box_points", "sample_surface"]

HULL_MARGIN_M = 0.5
"""Walls of an unknown room stand so far outside all places: as near as devices go."""


def sample_surface(
    room: RoomSpec | None,
    positions: np.ndarray,
    count: int,
    *,
    rng: np.random.Generator,
) -> np.ndarray:
    """Draw points on the walls and furniture of a scene.

    Parameters
    ----------
    room : RoomSpec or None
        Gives walls and furniture when it is known.
    positions : numpy.ndarray
        Places of both ends, shape (n, 3), metres; without a room their box,
        widened by half a metre, stands for the walls.
    count : int
        Number of points.
    rng : numpy.random.Generator
        Source of randomness.

    Returns
    -------
    numpy.ndarray
        Shape (count, 3), metres.

    Examples
    --------
    >>> corners = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    >>> points = sample_surface(None, corners, 8, rng=np.random.default_rng(0))
    >>> points.shape
    (8, 3)
    """
    boxes = _room_boxes(room) if room is not None else [_hull_box(positions)]
    areas = np.array([_box_area(low, high) for low, high in boxes])
    owner = rng.choice(len(boxes), size=count, p=areas / areas.sum())
    points = np.empty((count, 3))
    for index, (low, high) in enumerate(boxes):
        mine = owner == index
        points[mine] = box_points(low, high, int(mine.sum()), rng=rng)
    return points


def box_points(
    low: np.ndarray, high: np.ndarray, count: int, *, rng: np.random.Generator
) -> np.ndarray:
    """Draw points evenly over the six faces of a box, shape (count, 3)."""
    edges = high - low
    faces = np.array([edges[1] * edges[2], edges[0] * edges[2], edges[0] * edges[1]])
    axis = rng.choice(3, size=count, p=faces / faces.sum())
    points = low + rng.random((count, 3)) * edges
    side = np.where(rng.random(count) < 0.5, low[axis], high[axis])
    points[np.arange(count), axis] = side
    return points


def _room_boxes(room: RoomSpec) -> list[tuple[np.ndarray, np.ndarray]]:
    walls = (np.zeros(3), np.asarray(room.size_m, dtype=np.float64))
    things = [
        (np.asarray(box.low, dtype=np.float64), np.asarray(box.high, dtype=np.float64))
        for box in room.furniture
    ]
    return [walls, *things]


def _hull_box(positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    low, high = positions.min(axis=0), positions.max(axis=0)
    return low - HULL_MARGIN_M, high + HULL_MARGIN_M


def _box_area(low: np.ndarray, high: np.ndarray) -> float:
    x, y, z = high - low
    return float(2 * (x * y + y * z + z * x))
