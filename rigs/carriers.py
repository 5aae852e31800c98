"""The two carriers of a measurement: one for the emitter, one for the listener."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from rigs.faults import UnknownPositionError
from rigs.planning.coordination import CarrierStep, Coordination, sampled
from rigs.planning.order import Visits, visiting_order
from rigs.rig import Rig
from rir.errors import OutOfReachError, RigError
from rir.pose import Pose

SEED = 20240117
"""Of the order search, so that a plan is the same whenever it is made again."""


@dataclass
class Carriers:
    """Move emitter and listener together, so that they meet nothing and nobody.

    Parameters
    ----------
    emitter, listener
        The rigs that carry loudspeaker and microphone.
    separation
        Least distance in m between the two carried devices.

    Examples
    --------
    >>> from rigs.kinds.simulated import SimulatedRig
    >>> carriers = Carriers(SimulatedRig(), SimulatedRig())
    >>> a, b = Pose.at(1, 1, 1), Pose.at(2, 1, 1)
    >>> reached = carriers.place(a, b)
    >>> carriers.where() == reached
    True
    """

    emitter: Rig
    listener: Rig
    separation: float = 0.0

    @property
    def simulated(self) -> bool:
        """Whether either carrier is simulated."""
        return self.emitter.simulated or self.listener.simulated

    @property
    def rigs(self) -> tuple[Rig, Rig]:
        """Return emitter's and listener's rig."""
        return self.emitter, self.listener

    def coordination(self) -> Coordination | None:
        """Return the rules of joint moves; None if a person moves something."""
        envelopes = self.emitter.envelope, self.listener.envelope
        if envelopes[0] is None or envelopes[1] is None:
            return None
        return Coordination((envelopes[0], envelopes[1]), self.separation)

    # -- checking and planning ------------------------------------------------------

    def check(self, emitter: Pose, listener: Pose) -> None:
        """Raise `OutOfReachError` if the two poses cannot be held; move nothing."""
        self.emitter.check(emitter)
        self.listener.check(listener)
        rules = self.coordination()
        gap = emitter.distance(listener)
        if rules is not None:
            gap = rules.gap(emitter.position, listener.position)
        if gap < self.separation:
            raise OutOfReachError(
                f"emitter and listener would be {gap:.3f} m apart; the carriers need "
                f"{self.separation:.3f} m; choose poses further apart"
            )

    def order(self, pairs: Sequence[tuple[Pose, Pose]]) -> Visits:
        """Return a short order of pairs, each measured both ways by changing places.

        Raises
        ------
        OutOfReachError
            For the first pair that cannot be held either way.
        """
        for a, b in pairs:
            self.check(a, b)
            self.check(b, a)
        places = [np.array([pair[k].position for pair in pairs]) for k in (0, 1)]
        rng = np.random.default_rng(SEED)
        start = self.where()
        known = None
        if start[0] is not None and start[1] is not None:
            known = start[0].position, start[1].position
        rules = self.coordination()
        if rules is None:
            return visiting_order(*places, rng=rng, start=known)
        emitter = rules.roadmap(0, None).distances
        same = rules.envelopes[0] is rules.envelopes[1]
        listener = emitter if same else rules.roadmap(1, None).distances
        return visiting_order(
            *places, rng=rng, start=known, emitter=emitter, listener=listener
        )

    def steps(
        self, start: tuple[Pose, Pose], goal: tuple[Pose, Pose]
    ) -> list[tuple[int, list[Pose]]]:
        """Plan the moves between two pairs of poses: carrier, then poses to pass.

        Raises
        ------
        OutOfReachError
            If there is no way that keeps the carriers apart.
        """
        rules = self.coordination()
        if rules is None:
            return [(0, [goal[0]]), (1, [goal[1]])]
        steps = rules.plan(
            (start[0].position, start[1].position),
            (goal[0].position, goal[1].position),
        )
        return _posed(steps, start, goal)

    def duration(
        self, start: tuple[Pose, Pose] | None, end: tuple[Pose, Pose]
    ) -> float:
        """Estimate the seconds from one pair of poses to another."""
        if start is None:
            return sum(
                rig.duration(p, p) for rig, p in zip(self.rigs, end, strict=True)
            )
        total = 0.0
        here = list(start)
        for carrier, poses in self.steps(start, end):
            for pose in poses:
                total += self.rigs[carrier].duration(here[carrier], pose)
                here[carrier] = pose
        return total

    # -- moving -----------------------------------------------------------------------

    def place(self, emitter: Pose, listener: Pose) -> tuple[Pose, Pose]:
        """Bring both to their poses and return the poses reached.

        One carrier moves at a time, around keep-outs and around the other.

        Raises
        ------
        OutOfReachError
            Before anything moves.
        RigError
            If one did not arrive; both are stopped.
        """
        self.check(emitter, listener)
        goal = emitter, listener
        here = self.where()
        self._check_known()
        try:
            if here[0] is None or here[1] is None:
                return self.emitter.move(emitter), self.listener.move(listener)
            reached = [here[0], here[1]]
            for carrier, poses in self.steps((here[0], here[1]), goal):
                rig = self.rigs[carrier]
                reached[carrier] = rig.move(poses[-1], via=poses[:-1])
            return reached[0], reached[1]
        except BaseException:
            self.stop()
            raise

    def _check_known(self) -> None:
        lost = [f"{r.name}: {r.trouble()}" for r in self.rigs if r.trouble()]
        if lost:
            raise UnknownPositionError(
                f"nothing moves while a position is not known ({'; '.join(lost)}); "
                "home first"
            )

    def home(self) -> None:
        """Find the reference of every carrier whose position is not known.

        A carrier that knows where it is is first sent out of the way of the other's
        homing cycle. Before the very first homing nothing is known about either:
        watch it.

        Raises
        ------
        RigError
            If homing fails, or the two could meet in it.
        """
        unknown = [k for k in (0, 1) if self._unknown(k)]
        while unknown:
            k = next((k for k in unknown if self._may_home(k, unknown)), None)
            if k is None:
                names = " and ".join(rig.name for rig in self.rigs)
                raise RigError(
                    f"neither {names} knows where it is, and their homing could make "
                    "them meet; jog or push one out of the other's way, then home it "
                    "alone"
                )
            if 1 - k not in unknown:
                self._clear_the_way(k)
            self.rigs[k].home()
            unknown.remove(k)

    def _unknown(self, k: int) -> bool:
        """Tell whether a carrier is lost; a disturbed line gets a second chance."""
        return self.rigs[k].where() is None and self.rigs[k].where() is None

    def _may_home(self, homing: int, unknown: list[int]) -> bool:
        """Tell whether homing cannot meet the other one, which is lost as well."""
        rules, other = self.coordination(), 1 - homing
        sweep = self.rigs[homing].homing_sweep()
        if rules is None or other not in unknown or self.separation <= 0.0:
            return True
        spots = sampled(self.rigs[other].whereabouts())
        if not len(sweep) or not len(spots):
            return True
        return bool(rules.sweep_gap(sweep, spots).min() >= self.separation)

    def _clear_the_way(self, homing: int) -> None:
        """Move the other carrier away from where a homing cycle may pass."""
        other, rules = self.rigs[1 - homing], self.coordination()
        sweep = self.rigs[homing].homing_sweep()
        if rules is None or not len(sweep) or self.separation <= 0.0:
            return
        here = other.where()
        if here is None:
            raise RigError(f"{other.name} has become unknown: {other.trouble()}; home")
        if rules.sweep_gap(sweep, here.position[None])[0] >= self.separation:
            return
        lost = self.rigs[homing].whereabouts()
        way = rules.escape(1 - homing, here.position, sweep, lost)
        poses = [Pose(point, here.orientation) for point in way[1:]]
        other.move(poses[-1], via=poses[:-1])

    def confirm(self) -> tuple[float, float]:
        """Find out whether steps were lost: visit the reference of each carrier.

        Returns
        -------
        tuple of float
            Drift of emitter's and listener's carrier, m; NaN where a rig has no means.

        Raises
        ------
        RigError
            If steps were lost; that carrier's position is unknown then, and what was
            measured since the last confirmation must be repeated.
        """
        return self._confirm(0), self._confirm(1)

    def _confirm(self, k: int) -> float:
        rig, rules = self.rigs[k], self.coordination()
        corner = rig.reference_place()
        if corner is None or rules is None:
            return rig.confirm()
        self._check_known()
        envelope = rules.envelopes[k]
        near = np.clip(corner, envelope.low, envelope.high)
        self._leave(1 - k, np.array([[near, corner]]))
        here, other = self.rigs[k].where(), self.rigs[1 - k].where()
        if here is None or other is None:
            raise RigError("a carrier has become unknown; home it first")
        way = rules.roadmap(k, other.position).way(here.position, near)
        if not np.array_equal(way[0], way[-1]):
            poses = [Pose(point, here.orientation) for point in way[1:]]
            rig.move(poses[-1], via=poses[:-1])
        return rig.confirm()

    def _leave(self, k: int, ways: np.ndarray) -> None:
        """Send a carrier away from the boxes around some ways of the other one."""
        rules, here = self.coordination(), self.rigs[k].where()
        if rules is None or here is None or self.separation <= 0.0:
            return
        sweep = np.stack([ways.min(axis=1), ways.max(axis=1)], axis=1)
        if rules.sweep_gap(sweep, here.position[None])[0] >= self.separation:
            return
        way = rules.escape(k, here.position, sweep, self.rigs[1 - k].whereabouts())
        poses = [Pose(point, here.orientation) for point in way[1:]]
        self.rigs[k].move(poses[-1], via=poses[:-1])

    # -- the rest ---------------------------------------------------------------------

    def where(self) -> tuple[Pose | None, Pose | None]:
        """Return both poses, None where unknown."""
        return self.emitter.where(), self.listener.where()

    @contextmanager
    def quiet(self) -> Iterator[None]:
        """Keep both silent and still inside the block."""
        with ExitStack() as stack:
            stack.enter_context(self.emitter.quiet())
            stack.enter_context(self.listener.quiet())
            yield

    def stop(self) -> None:
        """Stop both, whatever one of them answers."""
        try:
            self.emitter.stop()
        finally:
            self.listener.stop()

    def close(self) -> None:
        """Release both."""
        try:
            self.emitter.close()
        finally:
            self.listener.close()

    def describe(self) -> dict[str, Any]:
        """Return what a data set should remember about both."""
        return {
            "emitter": self.emitter.describe(),
            "listener": self.listener.describe(),
            "separation_m": self.separation,
        }


def _posed(
    steps: list[CarrierStep], start: tuple[Pose, Pose], goal: tuple[Pose, Pose]
) -> list[tuple[int, list[Pose]]]:
    """Give each corner the orientation of where its carrier is going."""
    posed: list[tuple[int, list[Pose]]] = []
    for step in steps:
        turned = goal[step.carrier].orientation
        posed.append((step.carrier, [Pose(p, turned) for p in step.way[1:]]))
    moved = {carrier for carrier, _ in posed}
    for carrier in {0, 1} - moved:
        if start[carrier] != goal[carrier]:
            posed.append((carrier, [goal[carrier]]))
    return posed
