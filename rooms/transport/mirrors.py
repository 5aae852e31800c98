"""Energy of the images of a box, without their phases.

Once more than one image arrives a sample, a response tells no single one apart; what
counts is the energy they bring, place by place.
"""

import numpy as np
from numba import njit

from rir.arrays import FloatArray, IntArray
from rooms.box_images import NEAREST, walls_met
from rooms.kernels.responses import image_offsets

__all__ = ["image_energy"]

_MOST = 1_000_000
"""Images looked at for a pair: a few milliseconds."""


def image_energy(
    size: FloatArray,
    kept: FloatArray,
    ends: tuple[FloatArray, FloatArray],
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
    ends : tuple of ndarray, shape (3,) and (listeners, 3)
        Emitter and listeners [m]; exchanging two ends changes nothing.
    span : tuple (speed, step, steps)
        Speed of sound [m/s], time step [s] and number of steps.
    listed : tuple (order, share)
        Highest order of listed images, and the share of those that is not listed
        after all, step by step.

    Returns
    -------
    energy : ndarray, shape (listeners, steps, bands)
        Energy per second, in the unit of a response whose direct sound is 1/d.
    known : int
        Steps that are complete: later images are too many.

    Examples
    --------
    >>> ends = np.array([1.0, 2.0, 1.0]), np.array([[3.0, 2.0, 2.0]])
    >>> span = 343.0, 0.001, 20
    >>> walls = np.full((6, 1), 0.5)
    >>> args = np.array([5.0, 4.0, 3.0]), walls, ends, span, (0, np.zeros(20))
    >>> energy, known = image_energy(*args)
    >>> known, int(np.nonzero(energy[0, :, 0])[0][0])
    (20, 10)
    """
    speed, step, steps = span
    order, share = listed
    bands, lane_of = np.unique(kept, axis=1, return_inverse=True)
    most = float(np.cbrt(_MOST * 0.75 / np.pi * np.prod(size)))
    reach = min(speed * step * steps, most)
    axes = tuple(_axis(float(size[k]), bands[2 * k :], reach) for k in range(3))
    emitter, listeners = ends
    out = np.zeros((len(listeners), steps, bands.shape[1]))
    limits = min(order, 1 << 30), share, 1 / (speed * step), reach
    _add_images(size, axes, emitter, listeners, limits, out)
    return out[:, :, lane_of.ravel()] / step, int(reach / (speed * step) + 1e-6)


def _axis(
    length: float, kept: FloatArray, reach: float
) -> tuple[IntArray, FloatArray, IntArray]:
    """Return numbers, factors and reflections of images along an axis."""
    count = int(reach / length) + 2
    index = np.arange(-count, count + 1)
    near, far = (times[:, None] for times in walls_met(index))
    return index, kept[0] ** near * kept[1] ** far, np.abs(index)


@njit(cache=True, nogil=True, error_model="numpy")
def _add_images(size, axes, emitter, listeners, limits, out):
    for place in range(len(listeners)):
        one, other = emitter, listeners[place]
        for k in range(2, -1, -1):
            # the sums are the same to the last bit whichever end is the emitter
            if emitter[k] != listeners[place, k]:
                turned = emitter[k] > listeners[place, k]
                one = listeners[place] if turned else emitter
                other = emitter if turned else listeners[place]
        dx = image_offsets(axes[0][0], size[0], one[0], other[0]) ** 2
        dy = image_offsets(axes[1][0], size[1], one[1], other[1]) ** 2
        dz = image_offsets(axes[2][0], size[2], one[2], other[2]) ** 2
        _add_pair((dx, dy, dz), size[2], axes, limits, out[place])


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _add_pair(squares, pitch, axes, limits, out):
    (_, gx, ox), (_, gy, oy), (_, gz, oz) = axes
    dx, dy, dz = squares
    order, share, per_step, reach = limits
    steps, lanes = out.shape
    least = NEAREST * NEAREST
    gain, square, at = np.empty(lanes), np.empty(len(dz)), np.empty(len(dz))
    mid = len(dz) // 2
    for i in range(len(dx)):
        for j in range(len(dy)):
            across = dx[i] + dy[j]
            room = reach * reach - across
            if room <= 0.0:
                continue
            for lane in range(lanes):
                gain[lane] = gx[i, lane] * gy[j, lane]
            met = ox[i] + oy[j]
            # image k is at least |k| - 1 lengths away
            span = min(mid, int(np.sqrt(room) / pitch) + 1)
            low, count = mid - span, 2 * span + 1
            # square roots in a loop of their own vectorise
            for k in range(count):
                square[k] = across + dz[low + k]
                at[k] = np.sqrt(square[k]) * per_step
            for k in range(count):
                if dz[low + k] >= room or at[k] >= steps:
                    continue
                if met + oz[low + k] == 0:
                    continue
                step = int(at[k])
                part = share[step] if met + oz[low + k] <= order else 1.0
                part /= max(square[k], least)
                for lane in range(lanes):
                    out[step, lane] += part * gain[lane] * gz[low + k, lane]
