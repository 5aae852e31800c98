"""Places that emit and detect rays."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir.arrays import FloatArray
from rooms.mesh import MeshGeometry
from rooms.mesh.nearness import distances

__all__ = ["Places", "find_places"]

# m; of the root of the volume; of the ball: see `find_places`
_LARGEST, _SHARE, _SMALLEST = 2.0, 0.25, 0.3
_PROBES = 512  # the share of a ball that is seen, in steps of 0.2 %


@dataclass(frozen=True, eq=False)
class Places:
    """Points, with the ball around each in which passing rays are heard.

    Parameters
    ----------
    points : ndarray, shape (N, 3)
        Positions relative to the origin of the mesh [m].
    radius, volume : ndarray, shape (N,)
        Radius [m], and volume of what the point sees of its ball [m³].
    whole : ndarray of bool, shape (N,)
        Whether no surface cuts the ball.
    """

    points: FloatArray
    radius: FloatArray
    volume: FloatArray
    whole: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.points)

    def one(self, number: int) -> "Places":
        """Return one of the places."""
        k = slice(number, number + 1)
        ball = self.radius[k], self.volume[k], self.whole[k]
        return Places(self.points[k], *ball)

    @property
    def balls(self) -> tuple[Any, ...]:
        """The arrays as compiled loops take them."""
        x, y, z = np.ascontiguousarray(self.points.T)
        return x, y, z, self.radius, self.volume, self.whole


def find_places(geometry: MeshGeometry, points: ArrayLike) -> Places:
    """Return places with balls as large as the walls allow.

    A ball reaches to the nearest surface, at most 2 m or a quarter of the cube root
    of the volume; close to surfaces it does not shrink below 0.3 of that but counts
    only what its centre sees.
    """
    local = geometry.localised(points)
    largest = min(_LARGEST, _SHARE * max(geometry.volume, 1e-9) ** (1 / 3))
    nearest = distances(geometry.corners, local)
    radius = np.clip(nearest, _SMALLEST * largest, largest)
    whole = nearest >= radius * (1 - 1e-9)
    volume = 4 / 3 * np.pi * radius**3
    for index in np.nonzero(~whole)[0]:
        probes = local[index] + radius[index] * _ball_grid()
        seen = geometry.sees(local[index], probes)
        volume[index] *= max(float(seen.mean()), 1 / _PROBES)
    return Places(local, radius, volume, whole)


def _ball_grid() -> FloatArray:
    """Return points spread evenly over the unit ball (R3 sequence)."""
    step = 1.2207440846057596
    index = np.arange(1, _PROBES + 1)[:, None]
    u, v, w = ((index / step ** np.arange(1, 4)) % 1).T
    up, turn, far = 2 * u - 1, 2 * np.pi * v, np.cbrt(w)
    flat = np.sqrt(1 - up**2)
    way = np.column_stack([flat * np.cos(turn), flat * np.sin(turn), up])
    return far[:, None] * way
