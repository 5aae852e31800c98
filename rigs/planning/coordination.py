"""Moves of two carriers that never meet each other or a keep-out box."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rigs.planning.envelope import Envelope
from rigs.planning.paths import Roadmap
from rir.errors import OutOfReachError

REFUGES = 60  # places tried of the 216 of a grid, by detour: each is planned for


@dataclass(frozen=True, eq=False)
class CarrierStep:
    """One carrier goes along a way while the other one stands."""

    carrier: int
    """0 for the emitter's carrier, 1 for the listener's."""
    way: list[np.ndarray]
    """Corners of the way, start included, m."""

    @property
    def length(self) -> float:
        """Length of the way, m."""
        return float(sum(np.linalg.norm(np.diff(self.way, axis=0), axis=1)))


@dataclass(frozen=True, eq=False)
class Coordination:
    """The rules two carriers share."""

    envelopes: tuple[Envelope, Envelope]
    """Of the emitter's and the listener's carrier."""
    separation: float
    """Least distance between the two devices, m."""

    @property
    def flat(self) -> bool:
        """Whether the carriers have columns, so that only level distance counts."""
        return any(envelope.column != "none" for envelope in self.envelopes)

    def gap(self, a: np.ndarray, b: np.ndarray) -> float:
        """Return the distance that counts between the two devices, m."""
        between = np.asarray(a) - np.asarray(b)
        return float(np.linalg.norm(between[:2] if self.flat else between))

    def roadmap(self, carrier: int, other: np.ndarray | None) -> Roadmap:
        """Return the free space of one carrier while the other stands somewhere."""
        others = None
        if other is not None and self.separation > 0.0:
            others = np.tile(np.asarray(other), (1, 2, 1))
        return self._space(carrier, others)

    def _space(self, carrier: int, others: np.ndarray | None) -> Roadmap:
        envelope = self.envelopes[carrier]
        return Roadmap(envelope, others, separation=self.separation, flat=self.flat)

    def plan(
        self,
        start: tuple[np.ndarray, np.ndarray],
        goal: tuple[np.ndarray, np.ndarray],
    ) -> list[CarrierStep]:
        """Return steps that bring both carriers from start to goal.

        Tries either carrier first, then lets one step aside for the other.

        Raises
        ------
        OutOfReachError
            If no such steps are found.
        """
        plans = list(self._direct(start, goal))
        if not plans:
            plans = list(self._aside(start, goal))
        if not plans:
            raise OutOfReachError(
                "no order of moves was found that keeps the carriers "
                f"{self.separation:.3f} m apart on the way to "
                f"{np.round(goal[0], 3).tolist()} and {np.round(goal[1], 3).tolist()} "
                "m; choose other poses, or more room around them"
            )
        return min(plans, key=lambda steps: sum(step.length for step in steps))

    def sweep_gap(self, sweep: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return the distance that counts of points (N, 3) to some boxes, m."""
        level = np.array([1.0, 1.0, 0.0 if self.flat else 1.0])
        low, high = sweep[:, 0] * level, sweep[:, 1] * level
        spots = (points * level)[:, None]
        outside = np.maximum(np.maximum(low - spots, spots - high), 0.0)
        return np.linalg.norm(outside, axis=-1).min(axis=1)

    def escape(
        self, carrier: int, here: np.ndarray, sweep: np.ndarray, lost: np.ndarray
    ) -> list[np.ndarray]:
        """Return a way for one carrier out of the sweep of the other's homing.

        Parameters
        ----------
        carrier
            Which one gets out of the way.
        here
            Where it is.
        sweep
            Boxes the other's homing may pass through.
        lost
            Straight ways the other may be on now, shape (K, 2, 3), m.

        Raises
        ------
        OutOfReachError
            If there is none.
        """
        space = self._space(carrier, lost)
        grid = self.envelopes[carrier].grid(9)
        grid = grid[self.sweep_gap(sweep, grid) > 1.02 * self.separation]
        for refuge in grid[np.argsort(np.linalg.norm(grid - here, axis=1))]:
            try:
                return space.way(here, refuge)
            except OutOfReachError:
                continue
        raise OutOfReachError(
            "a carrier stands where the other one's homing may pass and finds no way "
            "out; move it away by hand or jog it, then home again"
        )

    def _direct(
        self,
        start: tuple[np.ndarray, np.ndarray],
        goal: tuple[np.ndarray, np.ndarray],
    ) -> Iterator[list[CarrierStep]]:
        for first in (0, 1):
            second = 1 - first
            try:
                one = self._way(first, start[first], goal[first], start[second])
                two = self._way(second, start[second], goal[second], goal[first])
            except OutOfReachError:
                continue
            yield [step for step in (one, two) if step.length > 0.0]

    def _way(
        self, carrier: int, start: np.ndarray, end: np.ndarray, other: np.ndarray
    ) -> CarrierStep:
        if np.array_equal(start, end):
            return CarrierStep(carrier, [start, end])
        return CarrierStep(carrier, self.roadmap(carrier, other).way(start, end))

    def _aside(
        self,
        start: tuple[np.ndarray, np.ndarray],
        goal: tuple[np.ndarray, np.ndarray],
    ) -> Iterator[list[CarrierStep]]:
        """Let one carrier wait at a refuge while the other passes."""
        for first in (0, 1):
            second = 1 - first
            space = self.roadmap(first, start[second])
            for refuge in self._refuges(first, start, goal, space):
                try:
                    away = CarrierStep(first, space.way(start[first], refuge))
                    over = self._way(second, start[second], goal[second], refuge)
                    back = self._way(first, refuge, goal[first], goal[second])
                except OutOfReachError:
                    continue
                yield [step for step in (away, over, back) if step.length > 0.0]
                break

    def _refuges(
        self,
        carrier: int,
        start: tuple[np.ndarray, np.ndarray],
        goal: tuple[np.ndarray, np.ndarray],
        space: Roadmap,
    ) -> np.ndarray:
        """Return places to wait at, the nearest first."""
        envelope = self.envelopes[carrier]
        axes = [
            np.linspace(a, b, 6)
            for a, b in zip(envelope.low, envelope.high, strict=True)
        ]
        grid = np.array(np.meshgrid(*axes)).reshape(3, -1).T
        free = np.ones(len(grid), bool)
        for other in (start[1 - carrier], goal[1 - carrier]):
            gaps = (grid - other) * space.flat
            free &= np.linalg.norm(gaps, axis=1) > self.separation
        grid = grid[free]
        detour = np.linalg.norm(grid - start[carrier], axis=1)
        detour = detour + np.linalg.norm(grid - goal[carrier], axis=1)
        return grid[np.argsort(detour)[:REFUGES]]


def sampled(ways: np.ndarray) -> np.ndarray:
    """Return points along straight ways (K, 2, 3), 2 cm apart, shape (N, 3), m."""
    points = [np.zeros((0, 3))]
    for start, end in ways:
        count = 2 + int(np.linalg.norm(end - start) / 0.02)
        points.append(np.linspace(start, end, count))
    return np.concatenate(points)
