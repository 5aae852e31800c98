"""Ways around keep-out boxes: straight if clear, else along corners of the boxes."""

import numpy as np
from numpy.typing import ArrayLike

from rigs.planning.distance import segment_box_distance, segment_segment_distance
from rigs.planning.envelope import Envelope
from rir.errors import OutOfReachError

MARGIN = 0.02
"""Extra room in m that way-points keep, so that rounding never scrapes a box."""


class Roadmap:
    """The free space of one carrier, as way-points and the clear ways between them.

    Parameters
    ----------
    envelope
        Reach, keep-outs and clearance.
    others
        Straight ways the other carrier may be on, shape (K, 2, 3), m.
    separation
        Distance to keep from them, m.
    flat
        Whether only level distance from them counts.

    Examples
    --------
    >>> from rigs.planning.envelope import KeepOut
    >>> wall = KeepOut("wall", [1, 0, 0], [1.2, 2, 2])
    >>> roadmap = Roadmap(Envelope([0, 0, 0], [3, 3, 2], [wall], clearance=0.1))
    >>> way = roadmap.way([0.5, 0.5, 1], [2, 0.5, 1])
    >>> len(way), bool(way[1][1] > 2.1)
    (4, True)
    """

    def __init__(
        self,
        envelope: Envelope,
        others: np.ndarray | None = None,
        *,
        separation: float = 0.0,
        flat: bool = False,
    ) -> None:
        self.envelope = envelope
        self.others = np.zeros((0, 2, 3)) if others is None else others
        self.separation = separation
        self.flat = np.array([1.0, 1.0, 0.0 if flat else 1.0])
        boxes = [(b.low, b.high) for b in envelope.keep_outs]
        grown = envelope.clearance + 1e-9
        self.low = np.array([low for low, _ in boxes]).reshape(-1, 3) - grown
        self.high = np.array([high for _, high in boxes]).reshape(-1, 3) + grown
        self.nodes = self._nodes()
        self.lengths = self._all_lengths()

    def _nodes(self) -> np.ndarray:
        choices = np.array(np.meshgrid(*[[0, 1]] * 3)).reshape(3, -1).T
        around = self.separation + MARGIN
        low = np.vstack([self.low - MARGIN, self.others.min(axis=1) - around])
        high = np.vstack([self.high + MARGIN, self.others.max(axis=1) + around])
        corners = np.where(choices[None], high[:, None], low[:, None]).reshape(-1, 3)
        corners = np.clip(corners, self.envelope.low, self.envelope.high)
        corners = np.unique(corners.round(6), axis=0)
        free = ~self.inside(corners) & self._clear_of_others(corners, corners)
        return corners[free]

    def _clear_of_others(self, starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
        clear = np.ones(np.broadcast_shapes(starts.shape, ends.shape)[:-1], bool)
        a, b = starts * self.flat, ends * self.flat
        for c, d in self.others * self.flat:
            clear &= segment_segment_distance(a, b, c, d) >= self.separation
        return clear

    def inside(self, points: np.ndarray) -> np.ndarray:
        """Tell for points (..., 3) whether each is too close to a box."""
        points = np.asarray(points, dtype=float)[..., None, :]
        return np.any(np.all((points > self.low) & (points < self.high), -1), -1)

    def clear(self, starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Tell for straight ways, shape (..., 3), whether each is clear."""
        free = self._clear_of_others(starts, ends)
        if not len(self.low):
            return free
        start, way = starts[..., None, :], (ends - starts)[..., None, :]
        with np.errstate(divide="ignore", invalid="ignore"):
            near, far = (self.low - start) / way, (self.high - start) / way
        enter, leave = np.fmin(near, far), np.fmax(near, far)
        within = (start >= self.low) & (start <= self.high)
        level = way == 0.0
        enter = np.where(level, np.where(within, -np.inf, np.inf), enter)
        leave = np.where(level, np.where(within, np.inf, -np.inf), leave)
        first, last = enter.max(axis=-1), leave.min(axis=-1)
        hit = (first < last) & (last > 0.0) & (first < 1.0)
        blocked = hit.any(axis=-1)
        return free & (~blocked | self._clear_by_rounding(starts, ends, blocked))

    def _clear_by_rounding(
        self, starts: np.ndarray, ends: np.ndarray, blocked: np.ndarray
    ) -> np.ndarray:
        """Look closer at ways near a grown box's corners: the corners are round."""
        clear = np.zeros(blocked.shape, bool)
        near = self.envelope.clearance
        suspects = blocked & (self.inside(starts) | self.inside(ends))
        if near <= 0.0 or not suspects.any():
            return clear
        shape = (*blocked.shape, 3)
        a = np.broadcast_to(starts, shape)[suspects][:, None]
        b = np.broadcast_to(ends, shape)[suspects][:, None]
        low, high = self.low + near, self.high - near
        clear[suspects] = np.all(segment_box_distance(a, b, low, high) > near, axis=-1)
        return clear

    def _all_lengths(self) -> np.ndarray:
        count = len(self.nodes)
        if not count:
            return np.zeros((0, 0))
        edges = self._edges(self.nodes, self.nodes)
        from scipy.sparse.csgraph import shortest_path

        lengths, self._before = shortest_path(
            np.where(np.isfinite(edges), edges, 0.0), return_predecessors=True
        )
        return lengths

    def _edges(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        starts, ends = a[:, None], b[None]
        gaps = np.linalg.norm(starts - ends, axis=-1)
        return np.where(self.clear(starts, ends), gaps, np.inf)

    def distances(self, a: ArrayLike, b: ArrayLike) -> np.ndarray:
        """Return the lengths of the shortest ways known, shape (len(a), len(b)), m.

        Infinite where no way was found.
        """
        a, b = np.atleast_2d(a).astype(float), np.atleast_2d(b).astype(float)
        straight = self._edges(a, b)
        if not len(self.nodes) or np.isfinite(straight).all():
            return straight
        to, back = self._edges(a, self.nodes), self._edges(self.nodes, b)
        through = _least_sum(_least_sum(to, self.lengths), back)
        return np.minimum(straight, through)

    def way(self, start: ArrayLike, end: ArrayLike) -> list[np.ndarray]:
        """Return the corners of a short clear way, both ends included.

        Raises
        ------
        OutOfReachError
            If none is found.
        """
        a, b = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
        if bool(self.clear(a, b)):
            return [a, b]
        total, first, last = np.inf, 0, 0
        if len(self.nodes):
            to = self._edges(a[None], self.nodes)[0]
            back = self._edges(self.nodes, b[None])[:, 0]
            sums = to[:, None] + self.lengths + back[None]
            first, last = np.unravel_index(int(np.argmin(sums)), sums.shape)
            total = sums[first, last]
        if not np.isfinite(total):
            raise OutOfReachError(
                f"no clear way from {a.round(3).tolist()} m to {b.round(3).tolist()} m "
                "around the keep-outs was found; move furniture or poses apart"
            )
        chain = [int(last)]
        while chain[-1] != first:
            chain.append(int(self._before[first, chain[-1]]))
        return [a, *(self.nodes[k] for k in reversed(chain)), b]


def _least_sum(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the min-plus product of two matrices of lengths."""
    return np.array([np.min(row[:, None] + b, axis=0) for row in a])
