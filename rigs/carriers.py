"""The two carriers of a measurement: one for the emitter, one for the listener."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any

from rigs.rig import Rig
from rir.errors import OutOfReachError
from rir.pose import Pose


@dataclass
class Carriers:
    """Move emitter and listener together, safely.

    Parameters
    ----------
    emitter, listener
        The rigs that carry loudspeaker and microphone.
    separation
        Least distance in m between the two carried devices.

    Examples
    --------
    >>> from rigs.simulated import SimulatedRig
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

    def check(self, emitter: Pose, listener: Pose) -> None:
        """Raise `OutOfReachError` if the two poses cannot be held; move nothing."""
        self.emitter.check(emitter)
        self.listener.check(listener)
        gap = emitter.distance(listener)
        if gap < self.separation:
            raise OutOfReachError(
                f"emitter and listener would be {gap:.3f} m apart; the carriers need "
                f"{self.separation:.3f} m; choose poses further apart"
            )

    def place(self, emitter: Pose, listener: Pose) -> tuple[Pose, Pose]:
        """Bring both to their poses and return the poses reached.

        Raises
        ------
        OutOfReachError
            Before anything moves.
        RigError
            If one did not arrive; both are stopped.
        """
        self.check(emitter, listener)
        try:
            return self.emitter.move(emitter), self.listener.move(listener)
        except BaseException:
            self.stop()
            raise

    def duration(
        self, start: tuple[Pose, Pose] | None, end: tuple[Pose, Pose]
    ) -> float:
        """Estimate the seconds from one pair of poses to another."""
        if start is None:
            return self.emitter.duration(*(end[0],) * 2)
        return self.emitter.duration(start[0], end[0]) + self.listener.duration(
            start[1], end[1]
        )

    def home(self) -> None:
        """Find the reference of both."""
        self.emitter.home()
        self.listener.home()

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
