"""Find free places for emitters and listeners in a scene."""

import numpy as np
from numpy.typing import NDArray

from rir import Poses
from rir.arrays import FloatArray
from rir.errors import SceneError
from rooms.scene import Scene

__all__ = ["grid_places", "random_places"]


def _inside(scene: Scene, points: FloatArray, clearance: float) -> NDArray[np.bool_]:
    """Tell which points are in the air, with free air around them."""
    free = ~scene.outside(points)
    for axis in range(3):
        for side in (-clearance, clearance):
            moved = points.copy()
            moved[:, axis] += side
            free[free] &= ~scene.outside(moved[free])
    return free


def _bounds(scene: Scene) -> tuple[FloatArray, FloatArray]:
    half = np.asarray(scene.geometry.size) / 2
    return scene.geometry.center - half, scene.geometry.center + half


def random_places(
    scene: Scene,
    count: int,
    rng: np.random.Generator,
    *,
    clearance: float = 0.3,
    heights: tuple[float, float] = (0.8, 1.9),
) -> Poses:
    """Draw free places, facing random ways.

    Parameters
    ----------
    scene : Scene
        The room.
    count : int
        Number of places.
    rng : numpy.random.Generator
        Source of randomness.
    clearance : float
        Distance kept to surfaces along each axis [m].
    heights : tuple of float
        Range of heights above the lowest point [m].

    Raises
    ------
    SceneError
        If the room has too little free air.
    """
    low, high = _bounds(scene)
    clearance = min(clearance, 0.2 * float((high - low).min()))
    top = min(low[2] + heights[1], high[2] - clearance)
    low = np.array([low[0], low[1], min(low[2] + heights[0], top)])
    high = np.array([high[0], high[1], top])
    found = np.empty((0, 3))
    for _ in range(200):
        drawn = rng.uniform(low, high, (4 * count, 3))
        found = np.concatenate([found, drawn[_inside(scene, drawn, clearance)]])
        if len(found) >= count:
            return Poses(found[:count], _headings(rng, count))
    raise SceneError(f"{scene.name} has no room for {count} free places")


def _headings(rng: np.random.Generator, count: int) -> FloatArray:
    half = rng.uniform(0, 2 * np.pi, count) / 2
    zeros = np.zeros(count)
    return np.stack([zeros, zeros, np.sin(half), np.cos(half)], axis=1)


def grid_places(
    scene: Scene, count: int, *, height: float = 1.2, clearance: float = 0.2
) -> Poses:
    """Return about `count` free places on a square grid at one height.

    Parameters
    ----------
    scene : Scene
        The room.
    count : int
        Number wanted; the spacing is chosen to come close from below.
    height : float
        Height above the lowest point [m].
    clearance : float
        Distance kept to surfaces along each axis [m].
    """
    low, high = _bounds(scene)
    level = low[2] + min(height, 0.5 * float(high[2] - low[2]))
    spacing = float(np.sqrt(_free_area(scene, low, high, level, clearance) / count))
    for _ in range(12):
        points = _grid(low, high, level, spacing)
        points = points[_inside(scene, points, clearance)]
        if 0 < len(points) <= count:
            return Poses(points)
        spacing *= 1.02 if len(points) else 0.7
    raise SceneError(
        f"{scene.name} has no room for {count} places {height:g} m above the floor"
    )


def _grid(
    low: FloatArray, high: FloatArray, level: float, spacing: float
) -> FloatArray:
    axes = [np.arange(low[k] + spacing / 2, high[k], spacing) for k in range(2)]
    flat = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.column_stack([flat, np.full(len(flat), level)])


def _free_area(
    scene: Scene, low: FloatArray, high: FloatArray, level: float, clearance: float
) -> float:
    """Estimate the free area at a level from a few hundred points [m²]."""
    area = float(np.prod(high[:2] - low[:2]))
    points = _grid(low, high, level, float(np.sqrt(area / 600)))
    return area * max(float(_inside(scene, points, clearance).mean()), 1e-3)
