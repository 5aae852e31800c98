"""How exactly a rig comes back: backlash and repeatability of one axis."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rigs.rig import Rig
from rir.errors import RigError
from rir.pose import Pose

COUNT = 200  # gives sigma to 10 % in 99 of 100 tests, see `run_approaches`


@dataclass(frozen=True)
class Repeatability:
    """Backlash and scatter of one axis at one place, m.

    Attributes
    ----------
    backlash
        Mean place reached from above minus from below.
    sigma
        Standard deviation of one approach, both directions pooled.
    low, high
        95 % confidence limits of `sigma`.
    drift
        Slope of the places over the whole test, m per approach.
    """

    backlash: float
    sigma: float
    low: float
    high: float
    drift: float


def judge_approaches(below: ArrayLike, above: ArrayLike) -> Repeatability:
    """Return backlash and repeatability from measured places.

    Parameters
    ----------
    below, above
        Places measured after approaches from below and from above, alternating in
        time, m.

    Raises
    ------
    RigError
        If there are fewer than 3 of either.

    References
    ----------
    ISO 230-2: reversal value and unidirectional repeatability. Confidence limits from
    the chi-square distribution of the pooled variance.

    Examples
    --------
    >>> result = judge_approaches([0.0, 1e-5, -1e-5], [1e-4, 1.1e-4, 0.9e-4])
    >>> round(1e6 * result.backlash, 3), round(1e6 * result.sigma, 3)
    (100.0, 10.0)
    """
    from scipy.stats import chi2

    up, down = np.asarray(below, dtype=float), np.asarray(above, dtype=float)
    if min(len(up), len(down)) < 3:
        raise RigError(
            f"repeatability needs at least 3 approaches from each side, got {len(up)} "
            f"and {len(down)}"
        )
    free = len(up) + len(down) - 2
    squares = np.sum((up - up.mean()) ** 2) + np.sum((down - down.mean()) ** 2)
    limits = np.sqrt(squares / chi2.ppf([0.975, 0.025], free))
    steps = [np.polyfit(np.arange(len(side)), side, 1)[0] / 2 for side in (up, down)]
    return Repeatability(
        backlash=float(down.mean() - up.mean()),
        sigma=float(np.sqrt(squares / free)),
        low=float(limits[0]),
        high=float(limits[1]),
        drift=float(np.mean(steps)),
    )


def run_approaches(
    rig: Rig,
    place: Pose,
    axis: int,
    read: Callable[[], float],
    *,
    distance: float = 0.05,
    count: int = COUNT,
) -> Repeatability:
    """Approach a place from both sides again and again, and read a gauge each time.

    Parameters
    ----------
    rig
        The rig.
    place
        Where the gauge stands.
    axis
        0, 1 or 2: the room axis along which it approaches.
    read
        Returns the gauge's reading, m.
    distance
        How far it goes away each time, m.
    count
        Approaches from each side; 200 give sigma to 10 % in 99 of 100 tests.
    """
    away = np.zeros(3)
    away[axis] = distance
    readings: tuple[list[float], list[float]] = ([], [])
    for _ in range(count):
        for side, offset in enumerate((-away, away)):
            rig.move(place, via=[Pose(place.position + offset, place.orientation)])
            readings[side].append(read())
    return judge_approaches(*readings)
