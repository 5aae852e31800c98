"""Energy of the images of a box, without their phases.

Once more than one image arrives a sample, a response tells no single one apart; what
counts is the energy they bring, place by place.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rir.arrays import FloatArray

__all__ = ["image_energy"]

_MOST = 1_000_000
"""Images looked at for a pair: a few milliseconds."""

_NEAREST = 0.01
"""Images nearer than this count as there [m], as where they are listed."""


def image_energy(
    size: FloatArray,
    kept: FloatArray,
    places: tuple[FloatArray, FloatArray],
    span: tuple[float, float, int],
    listed: tuple[int, FloatArray],
) -> tuple[FloatArray, int]:
    """Return the energy that no listed image brings, and up to when it is known.

    Parameters
    ----------
    size : ndarray, shape (3,)
        Lengths of the box [m].
    kept : ndarray, shape (6, bands)
        Shares of the energy that the walls mirror.
    places : tuple of ndarray, shape (3,)
        The two ends [m]; exchanging them changes nothing.
    span : tuple (speed, step, steps)
        Speed of sound [m/s], time step [s] and number of steps.
    listed : tuple (order, share)
        Highest order of listed images, and the share of those that is not listed
        after all, step by step.

    Returns
    -------
    energy : ndarray, shape (steps, bands)
        Energy per second, in the unit of a response whose direct sound is 1/d.
    known : int
        Steps that are complete: later images are too many.

    Examples
    --------
    >>> ends = np.array([1.0, 2.0, 1.0]), np.array([3.0, 2.0, 2.0])
    >>> span = 343.0, 0.001, 20
    >>> walls = np.full((6, 1), 0.5)
    >>> args = np.array([5.0, 4.0, 3.0]), walls, ends, span, (0, np.zeros(20))
    >>> energy, known = image_energy(*args)
    >>> known, int(np.nonzero(energy[:, 0])[0][0])
    (20, 10)
    """
    speed, step, steps = span
    order, share = listed
    bands, lane_of = np.unique(kept, axis=1, return_inverse=True)
    reach = min(
        speed * step * steps, float(np.cbrt(_MOST * 0.75 / np.pi * np.prod(size)))
    )
    first, second = sorted(places, key=lambda place: tuple(place.tolist()))
    axes = tuple(_axis(size, bands, k, reach, first, second) for k in range(3))
    out = np.zeros((steps, bands.shape[1]))
    _add_images(axes, min(order, 1 << 30), share, 1 / (speed * step), reach, out)
    return out[:, lane_of.ravel()] / step, int(reach / (speed * step) + 1e-6)


def _axis(
    size: FloatArray,
    kept: FloatArray,
    axis: int,
    reach: float,
    one: FloatArray,
    other: FloatArray,
) -> tuple[FloatArray, FloatArray, NDArray[np.int64]]:
    """Return squared offsets, factors and reflections of images along an axis."""
    length = float(size[axis])
    count = int(reach / length) + 2
    index = np.arange(-count, count + 1)
    even = index * length + (one[axis] - other[axis])
    odd = (index + 1) * length - (one[axis] + other[axis])
    more, fewer = (np.abs(index) + 1) // 2, np.abs(index) // 2
    near = np.where(index > 0, fewer, more)[:, None]
    far = np.where(index > 0, more, fewer)[:, None]
    factor = kept[2 * axis] ** near * kept[2 * axis + 1] ** far
    return np.where(index % 2 == 0, even, odd) ** 2, factor, np.abs(index)


@njit(cache=True, nogil=True, error_model="numpy")
def _add_images(axes, order, share, per_step, reach, out):
    (dx, gx, ox), (dy, gy, oy), (dz, gz, oz) = axes
    steps, lanes = out.shape
    least = _NEAREST * _NEAREST
    gain = np.empty(lanes)
    for i in range(len(dx)):
        for j in range(len(dy)):
            across = dx[i] + dy[j]
            room = reach * reach - across
            if room <= 0.0:
                continue
            for lane in range(lanes):
                gain[lane] = gx[i, lane] * gy[j, lane]
            met = ox[i] + oy[j]
            for k in range(len(dz)):
                if dz[k] >= room or met + oz[k] == 0:
                    continue
                square = across + dz[k]
                step = int(np.sqrt(square) * per_step)
                if step >= steps:
                    continue
                part = share[step] if met + oz[k] <= order else 1.0
                part /= max(square, least)
                for lane in range(lanes):
                    out[step, lane] += part * gain[lane] * gz[k, lane]
