"""Where a carrier may be: the reach of its axes and the boxes it must not enter."""

import itertools
from collections.abc import Sequence
from copy import copy
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from rigs.planning.distance import segment_box_distance
from rir.errors import ConfigError, OutOfReachError
from rir.pose import Pose

Column = Literal["none", "up", "down"]
FAR = 1e3
"""Beyond any room, m."""


def _triple(point: np.ndarray) -> str:
    return "[" + ", ".join(f"{value:.3f}" for value in point) + "] m"


def _corners(low: ArrayLike, high: ArrayLike, what: str) -> tuple[np.ndarray, ...]:
    corners = np.array(low, dtype=np.float64), np.array(high, dtype=np.float64)
    for corner in corners:
        corner.setflags(write=False)
    if any(c.shape != (3,) for c in corners) or not np.all(corners[0] <= corners[1]):
        raise ConfigError(
            f"{what} needs low <= high with 3 coordinates in metres, got low "
            f"{corners[0].tolist()} and high {corners[1].tolist()}"
        )
    return corners


class KeepOut:
    """A closed axis-aligned box no carrier may enter, in room metres."""

    def __init__(self, name: str, low: ArrayLike, high: ArrayLike) -> None:
        self.name = name
        self.low, self.high = _corners(low, high, f"keep-out {name!r}")

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the distance of points (..., 3) to the box in m, 0 inside."""
        outside = np.maximum(np.maximum(self.low - points, points - self.high), 0.0)
        return np.linalg.norm(outside, axis=-1)


def _shadowed(box: KeepOut, column: Column) -> KeepOut:
    """Return the box with the space in which a column would cut through it."""
    low, high = box.low.copy(), box.high.copy()
    if column == "up":
        low[2] = -FAR
    elif column == "down":
        high[2] = FAR
    return KeepOut(box.name, low, high)


class Envelope:
    """The reach of a carrier's reference point and what it must keep clear of.

    Parameters
    ----------
    low, high
        Corners of the reach of the carried device's centre, shape (3,), m.
    keep_outs
        Boxes to stay out of.
    clearance
        Radius in m of the ball around the centre that holds the carried device;
        it must stay clear of every keep-out.
    column
        Whether the device hangs on a column from above ("up") or stands on one
        ("down"); the column must stay clear of the keep-outs too.

    Examples
    --------
    >>> from rir.pose import Pose
    >>> table = KeepOut("table", [1, 1, 0], [2, 2, 0.8])
    >>> envelope = Envelope([0, 0, 0], [4, 3, 2.5], (table,), clearance=0.2)
    >>> envelope.check(Pose.at(0.5, 0.5, 1.2))
    >>> envelope.check(Pose.at(9, 0, 0))
    Traceback (most recent call last):
    ...
    rir.errors.OutOfReachError: pose [9.000, 0.000, 0.000] m is 5.000 m beyond the \
x reach of 0.000 to 4.000 m; choose a pose inside
    """

    def __init__(
        self,
        low: ArrayLike,
        high: ArrayLike,
        keep_outs: Sequence[KeepOut] = (),
        clearance: float = 0.0,
        column: Column = "none",
    ) -> None:
        self.low, self.high = _corners(low, high, "an envelope")
        self.column: Column = column
        self.keep_outs = tuple(_shadowed(box, column) for box in keep_outs)
        self.clearance = clearance

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Tell for points (..., 3) whether each is in reach and clear of all boxes."""
        points = np.asarray(points, dtype=np.float64)
        inside = np.all((points >= self.low) & (points <= self.high), axis=-1)
        for box in self.keep_outs:
            inside &= box.distance(points) > self.clearance
        return inside

    def within(self, low: np.ndarray, high: np.ndarray) -> "Envelope":
        """Return the part of this envelope inside a box.

        Raises
        ------
        ConfigError
            If they do not overlap.
        """
        cut = copy(self)
        cut.low, cut.high = _corners(
            np.maximum(self.low, low),
            np.minimum(self.high, high),
            "the reach within the machine's travel (check frame and envelope): it",
        )
        return cut

    def grid(self, count: int) -> np.ndarray:
        """Return the allowed points of a grid over the reach, shape (N, 3), m."""
        axes = [
            np.linspace(a, b, count) for a, b in zip(self.low, self.high, strict=True)
        ]
        points = np.array(np.meshgrid(*axes)).reshape(3, -1).T
        return points[self.contains(points)]

    def check(self, pose: Pose, who: str = "") -> None:
        """Raise `OutOfReachError` with the numbers if the pose is not allowed."""
        point = np.asarray(pose.position, dtype=np.float64)
        what = f"{who} pose" if who else "pose"
        self._check_reach(point, what)
        for box in self.keep_outs:
            gap = float(box.distance(point))
            if gap <= self.clearance:
                raise OutOfReachError(
                    f"{what} {_triple(point)} is {gap:.3f} m from keep-out "
                    f"{box.name!r} ({_triple(box.low)} to {_triple(box.high)}); the "
                    f"carrier needs more than {self.clearance:.3f} m; choose a pose "
                    "further away"
                )

    def path_gap(self, points: np.ndarray) -> float:
        """Return the least room in m between a way and the keep-outs, less clearance.

        Parameters
        ----------
        points
            Corners of the way, shape (N, 3), m.
        """
        if not self.keep_outs or len(points) == 0:
            return float("inf")
        low = np.array([box.low for box in self.keep_outs])
        high = np.array([box.high for box in self.keep_outs])
        starts = points[:-1] if len(points) > 1 else points
        ends = points[1:] if len(points) > 1 else points
        gaps = segment_box_distance(starts[:, None], ends[:, None], low, high)
        return float(gaps.min()) - self.clearance

    def check_path(self, points: np.ndarray, who: str = "") -> None:
        """Raise `OutOfReachError` if the straight ways between points are not clear."""
        for start, end in itertools.pairwise(points):
            for box in self.keep_outs:
                gap = float(segment_box_distance(start, end, box.low, box.high))
                if gap <= self.clearance:
                    raise OutOfReachError(
                        f"the straight way of {who or 'the carrier'} from "
                        f"{_triple(start)} to {_triple(end)} passes {gap:.3f} m from "
                        f"keep-out {box.name!r}; it needs more than "
                        f"{self.clearance:.3f} m; go by way-points around it"
                    )

    def _check_reach(self, point: np.ndarray, what: str) -> None:
        if not np.all(np.isfinite(point)):
            raise OutOfReachError(
                f"{what} {_triple(point)} is not finite; give three numbers in metres"
            )
        beyond = np.maximum(self.low - point, point - self.high)
        axis = int(np.argmax(beyond))
        if beyond[axis] > 0.0:
            raise OutOfReachError(
                f"{what} {_triple(point)} is {beyond[axis]:.3f} m beyond the "
                f"{'xyz'[axis]} reach of {self.low[axis]:.3f} to "
                f"{self.high[axis]:.3f} m; choose a pose inside"
            )
