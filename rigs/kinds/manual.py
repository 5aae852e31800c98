"""A person as the rig: the program says where things go, the person puts them there."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Literal

import numpy as np

from rigs.kinds.settings import EnvelopeConfig
from rigs.kinds.unwired import UnwiredRig
from rigs.planning.envelope import Envelope
from rigs.rig import RIGS, RigKind, Surroundings
from rir.config import StrictModel
from rir.errors import RigError
from rir.pose import Pose


def instruction(name: str, pose: Pose) -> str:
    """Return the sentence that tells a person where a device goes.

    Examples
    --------
    >>> instruction("microphone", Pose.at(1.0, 2.0, 1.2, yaw_deg=90))
    'put the microphone at x 1.000 m, y 2.000 m, z 1.200 m, facing 90° (pitch 0°)'
    """
    x, y, z = (float(value) for value in pose.position)
    forward = np.asarray(pose.forward)
    yaw = np.degrees(np.arctan2(forward[1], forward[0]))
    pitch = np.degrees(np.arcsin(np.clip(forward[2], -1.0, 1.0)))
    return (
        f"put the {name} at x {x:.3f} m, y {y:.3f} m, z {z:.3f} m, facing "
        f"{yaw + 0.0:.0f}° (pitch {pitch + 0.0:.0f}°)"
    )


class ManualRig(UnwiredRig):
    """Ask a person to carry the device, and believe the answer.

    Parameters
    ----------
    ask
        Called with one sentence; returns True when the person has done it.
    envelope
        Where the device may be put; anywhere by default.
    seconds
        Time a person needs for one move, for estimates.

    Examples
    --------
    >>> rig = ManualRig(lambda text: True, name="microphone")
    >>> rig.move(Pose.at(1, 1, 1)).position.tolist()
    [1.0, 1.0, 1.0]
    """

    simulated = False

    def __init__(
        self,
        ask: Callable[[str], bool],
        *,
        envelope: Envelope | None = None,
        name: str = "device",
        seconds: float = 60.0,
    ) -> None:
        self.name = name
        self.envelope = envelope
        self.seconds = seconds
        self._ask = ask
        self._pose: Pose | None = None

    def check(self, pose: Pose) -> None:
        """Raise `OutOfReachError` if the pose is outside the envelope, when given."""
        if self.envelope is not None:
            self.envelope.check(pose, self.name)

    def move(self, pose: Pose, via: Sequence[Pose] = ()) -> Pose:
        """Ask for the device to be put at the pose; way-points are left to the person.

        Raises
        ------
        RigError
            If the person says it was not done.
        """
        del via
        self.check(pose)
        self._pose = None
        if not self._ask(instruction(self.name, pose)):
            raise RigError(
                f"the {self.name} was not put at {np.round(pose.position, 3)} m; its "
                "place is unknown; start the move again when it can be done"
            )
        self._pose = pose
        return pose

    def duration(self, start: Pose, end: Pose) -> float:
        """Return the time a person needs, 0 for staying."""
        return 0.0 if start.distance(end) == 0.0 else self.seconds

    def where(self) -> Pose | None:
        """Return the pose last confirmed by the person, None if there is none."""
        return self._pose

    @contextmanager
    def quiet(self) -> Iterator[None]:
        """Do nothing: nothing is switched off."""
        yield

    def stop(self) -> None:
        """Do nothing: the person sees for themselves."""

    def close(self) -> None:
        """Release nothing."""

    def describe(self) -> dict[str, Any]:
        """Return the name and kind."""
        return {"name": self.name, "kind": "manual", "simulated": False}


class ManualConfig(StrictModel):
    """The part of a rig file that describes a person."""

    kind: Literal["manual"] = "manual"
    device: str = "device"
    envelope: EnvelopeConfig | None = None
    seconds_per_move: float = 60.0

    @property
    def simulated(self) -> bool:
        """Whether nothing real moves."""
        return False


def _build(config: ManualConfig, around: Surroundings) -> ManualRig:
    envelope = config.envelope.envelope() if config.envelope else None
    return ManualRig(
        around.ask,
        envelope=envelope,
        name=config.device,
        seconds=config.seconds_per_move,
    )


RIGS.add("manual")(RigKind("asks a person to move things", ManualConfig, _build))
