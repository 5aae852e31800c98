"""A rig of pure thought: it goes where it is told and takes as long as a real one."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Literal

from rigs.clock import Clock, VirtualClock
from rigs.kinds.settings import EnvelopeConfig
from rigs.kinds.unwired import UnwiredRig
from rigs.motion import travel_time, turn_angle
from rigs.planning.envelope import Envelope
from rigs.rig import RIGS, RigKind, Surroundings
from rir.config import StrictModel
from rir.pose import Pose


class SimulatedRig(UnwiredRig):
    """Carry nothing to any pose inside an envelope, and report it to a callback.

    Parameters
    ----------
    on_pose
        Told each pose reached (``world.place_emitter``, for instance).
    envelope
        Where it may go; everywhere in a 1 km cube by default.
    clock
        Passes the travel time; simulated time, hence at once, by default.
    speed, acceleration
        Limits of the travel, m/s and m/s².
    turn_rate
        Degrees per second of turning, done while travelling.
    settle
        Seconds waited after each move.
    start
        Pose at the start; the nearest corner `low` of the envelope by default.

    Examples
    --------
    >>> from rir.pose import Pose
    >>> seen = []
    >>> rig = SimulatedRig(seen.append)
    >>> reached = rig.move(Pose.at(1.0, 2.0, 1.2))
    >>> seen[-1].position.tolist()
    [1.0, 2.0, 1.2]
    """

    simulated = True

    def __init__(
        self,
        on_pose: Callable[[Pose], None] | None = None,
        *,
        envelope: Envelope | None = None,
        clock: Clock | None = None,
        speed: float = 0.25,
        acceleration: float = 0.5,
        turn_rate: float = 45.0,
        settle: float = 1.0,
        start: Pose | None = None,
        name: str = "simulated rig",
    ) -> None:
        self.name = name
        self.envelope = envelope or Envelope([-500.0] * 3, [500.0] * 3)
        self.clock = clock or VirtualClock()
        self.speed = speed
        self.acceleration = acceleration
        self.turn_rate = turn_rate
        self.settle = settle
        self._on_pose = on_pose
        self._pose = start

    def check(self, pose: Pose) -> None:
        """Raise `OutOfReachError` if the pose is outside the envelope."""
        self.envelope.check(pose, self.name)

    def move(self, pose: Pose, via: Sequence[Pose] = ()) -> Pose:
        """Let the travel time pass, report the pose and return it."""
        for point in (*via, pose):
            self.check(point)
        for point in (*via, pose):
            if self._pose is not None:
                self.clock.sleep(self._travel(self._pose, point))
            self._pose = point
        self.clock.sleep(self.settle)
        if self._on_pose is not None:
            self._on_pose(pose)
        return pose

    def _travel(self, start: Pose, end: Pose) -> float:
        straight = travel_time(start.distance(end), self.speed, self.acceleration)
        return max(straight, turn_angle(start, end) / self.turn_rate)

    def duration(self, start: Pose, end: Pose) -> float:
        """Estimate the seconds of a move, settling included."""
        return self._travel(start, end) + self.settle

    def where(self) -> Pose | None:
        """Return the pose; None before the first move if no start was given."""
        return self._pose

    @contextmanager
    def quiet(self) -> Iterator[None]:
        """Do nothing: it makes no noise."""
        yield

    def stop(self) -> None:
        """Do nothing: moves are instantaneous to everyone but the clock."""

    def close(self) -> None:
        """Release nothing."""

    def describe(self) -> dict[str, Any]:
        """Return the name, kind and speeds."""
        return {
            "name": self.name,
            "kind": "simulated",
            "simulated": True,
            "speed_m_per_s": self.speed,
            "settle_s": self.settle,
        }


class SimulatedConfig(StrictModel):
    """The part of a rig file that describes a simulated rig."""

    kind: Literal["simulated"] = "simulated"
    envelope: EnvelopeConfig | None = None
    speed_m_per_s: float = 0.25
    acceleration_m_per_s2: float = 0.5
    turn_rate_deg_per_s: float = 45.0
    settle_s: float = 1.0

    @property
    def simulated(self) -> bool:
        """Whether nothing real moves."""
        return True


def _build(config: SimulatedConfig, around: Surroundings) -> SimulatedRig:
    return SimulatedRig(
        around.on_pose,
        envelope=config.envelope.envelope() if config.envelope else None,
        clock=around.clock,
        speed=config.speed_m_per_s,
        acceleration=config.acceleration_m_per_s2,
        turn_rate=config.turn_rate_deg_per_s,
        settle=config.settle_s,
    )


RIGS.add("simulated")(
    RigKind("moves nothing, takes its time, reports poses", SimulatedConfig, _build)
)
