"""Sets of rays: spread evenly, the same in every run."""

import numpy as np

from rir.arrays import FloatArray

__all__ = ["emission_rays", "place_rays", "volume_rays"]

_RAREST = 8.0
"""Most that stretching thins rays out: some sixty of a place's still fill a sphere."""


def _spread(count: int, dimensions: int) -> FloatArray:
    """Return points that fill the unit cube evenly, shape (count, dimensions).

    M. Roberts, The unreasonable effectiveness of quasirandom sequences, 2018: steps
    of powers of the root of x^(d + 1) = x + 1.
    """
    root = 1.5
    for _ in range(60):
        root = (1 + root) ** (1 / (dimensions + 1))
    steps = root ** -np.arange(1.0, dimensions + 1)
    return (0.5 + np.arange(1, count + 1)[:, None] * steps) % 1


def _ways(up: FloatArray, turn: FloatArray) -> FloatArray:
    flat, angle = np.sqrt(1 - up**2), 2 * np.pi * turn
    return np.stack([flat * np.cos(angle), flat * np.sin(angle), up], axis=1)


def place_rays(size: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Return directions (count, 3) of a place's rays, and weights that add to one.

    A spiral, even over the sphere (Á. González, Mathematical Geosciences 42, 49,
    2010), turned so that it has no axis in common with a box, then stretched as the
    box is, see `_stretched`.
    """
    index = np.arange(count)
    spiral = _ways(1 - (2 * index + 1) / count, index * (np.sqrt(5) - 1) / 2 % 1)
    a, b = 0.7, 1.1  # rad: any two that are no simple fractions of a turn
    one = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    two = np.array([[np.cos(b), -np.sin(b), 0], [np.sin(b), np.cos(b), 0], [0, 0, 1]])
    ways, rarer = _stretched(spiral @ (one @ two).T, size)
    return ways, rarer / rarer.sum()


def _stretched(ways: FloatArray, size: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return ways stretched as a box is from a cube, and how much rarer they become.

    The far ends of a corridor are seen under a small angle, and send back what lasts.
    """
    stretch = size / np.cbrt(np.prod(size))
    rarest = -3 * np.log(stretch.min())
    stretch = stretch ** (np.log(_RAREST) / max(rarest, np.log(_RAREST)))
    ways = ways * stretch
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    # a linear map that keeps volumes makes directions rarer by the cube of lengths
    rarer = np.linalg.norm(ways / stretch, axis=1) ** 3
    return np.ascontiguousarray(ways), rarer


def emission_rays(
    size: FloatArray, wall: int, count: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return rays that stand for Lambert emission of a whole wall.

    Ways nearly parallel to other walls, along which sound lasts longest, are drawn more
    often than Lambert's law says, and weigh less.

    Parameters
    ----------
    size : ndarray, shape (3,)
        Lengths of the box [m].
    wall : int
        0 to 5: x0, x1, y0, y1, floor, ceiling.
    count : int
        Number of rays.

    Returns
    -------
    starts, ways : ndarray, shape (count, 3)
        Points [m] and directions.
    weights : ndarray, shape (count,)
        They add to 1.
    """
    u = _spread(count, 4)
    axis, far = divmod(wall, 2)
    one, other = (axis + 1) % 3, (axis + 2) % 3
    starts, ways = np.empty((2, count, 3))
    starts[:, axis] = far * size[axis]
    starts[:, one], starts[:, other] = u[:, 0] * size[one], u[:, 1] * size[other]
    along, up = 2 * u[:, 2] - 1, 2 * u[:, 3] - 1
    along = along * np.abs(along)
    flat = np.sqrt(1 - along**2)
    turned = np.arange(count) < count // 2
    ways[:, one] = np.where(turned, along, flat * up)
    ways[:, other] = np.where(turned, flat * up, along)
    ways[:, axis] = (1 - 2 * far) * flat * np.sqrt(1 - up**2)
    drawn = [
        1 / np.sqrt(np.abs(x) * (1 - x**2)) for x in (ways[:, one], ways[:, other])
    ]
    weights = 1 / (drawn[0] + drawn[1])
    return starts, ways, weights / weights.sum()


def volume_rays(
    size: FloatArray, count: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return rays from all over a box and all around, as `emission_rays` does."""
    u = _spread(count, 5)
    along, turn = 2 * u[:, 3] - 1, 2 * np.pi * u[:, 4]
    along = along * np.abs(along)
    flat = np.sqrt(1 - along**2)
    bare = np.stack([flat * np.cos(turn), flat * np.sin(turn), along], axis=1)
    axes = (3 * np.arange(count)[:, None] // count + np.arange(3)) % 3
    ways = np.take_along_axis(bare, axes, axis=1)
    weights = 1 / np.sum(1 / np.sqrt(np.maximum(np.abs(ways), 1e-300)), axis=1)
    ways, rarer = _stretched(ways, size)
    weights = weights * rarer
    return u[:, :3] * size, ways, weights / weights.sum()
