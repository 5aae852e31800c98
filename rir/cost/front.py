"""The settings worth taking, and the one to recommend."""

import math
from collections.abc import Sequence
from dataclasses import replace

from rir.cost.point import CostPoint

__all__ = ["knee_of", "mark_front"]


def mark_front(points: Sequence[CostPoint]) -> tuple[CostPoint, ...]:
    """Mark the Pareto front: points that no other beats in both ways.

    Examples
    --------
    >>> def at(seconds, error):
    ...     return CostPoint("", seconds, seconds, seconds, error, error, error, 1)
    >>> [p.on_front for p in mark_front([at(1, 3), at(2, 4), at(3, 1)])]
    [True, False, True]
    """

    def beaten(p: CostPoint) -> bool:
        return not (math.isfinite(p.error) and math.isfinite(p.seconds)) or any(
            q.seconds <= p.seconds
            and q.error <= p.error
            and (q.seconds < p.seconds or q.error < p.error)
            for q in points
        )

    return tuple(replace(p, on_front=not beaten(p)) for p in points)


def knee_of(points: Sequence[CostPoint]) -> int:
    """Return the index of the recommended point of the front; -1 if there is none.

    Of the logarithms of seconds and error, scaled to the unit square, it is the
    point farthest under the line between the ends of the front. If none is under
    it, it is the end worth its price: the dear one, if half the error costs less
    than twice the seconds on the way there.

    References
    ----------
    Satopää et al., "Finding a kneedle in a haystack", ICDCSW 2011.
    """
    front = sorted(
        (k for k, p in enumerate(points) if p.on_front),
        key=lambda k: points[k].seconds,
    )
    if len(front) < 3:
        return front[-1] if front else -1
    x, y = (
        [math.log(max(getattr(points[k], name), 1e-300)) for k in front]
        for name in ("seconds", "error")
    )
    wide, tall = x[-1] - x[0], y[0] - y[-1]
    if not wide or not tall:
        return front[0]
    depth = [(y[0] - b) / tall - (a - x[0]) / wide for a, b in zip(x, y, strict=True)]
    best = max(range(len(front)), key=depth.__getitem__)
    if depth[best] <= 0:
        return front[-1 if wide < tall else 0]
    return front[best]
