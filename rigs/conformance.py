"""What every kind of rig promises; run it on your own by its name."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from rigs.clock import VirtualClock
from rigs.kinds import RIGS, Surroundings
from rigs.rig import Rig
from rir.conformance import promise, refusal
from rir.errors import OutOfReachError, RigError
from rir.pose import Pose

__all__ = ["ENVELOPE", "INSIDE", "check_rig", "homed"]

ENVELOPE = {
    "low_m": [0, 0, 0],
    "high_m": [2, 2, 2],
    "keep_outs": [{"name": "table", "low_m": [1.2, 0, 0], "high_m": [2, 2, 1.2]}],
    "clearance_m": 0.1,
}
"""Where a rig under test may be: the envelope of its part of a rig file."""
INSIDE = Pose.at(0.5, 0.4, 1.0)
"""A pose that a rig under test can reach."""
OUTSIDE = {
    "7.000 m beyond the x reach": Pose.at(9, 0.4, 1.0),
    "keep-out 'table'": Pose.at(1.5, 0.4, 1.0),
    "0.050 m from keep-out 'table'": Pose.at(1.15, 0.4, 1.0),
}
"""Poses beyond the envelope, by what must be said of each."""
REACHED_M = 1e-4
"""A pose reached may differ by so much: half a step of a coarse stepper is less."""


def check_rig(name: str, part: Mapping[str, Any]) -> None:
    """Check that a kind of rig goes where it is told, and nowhere else.

    Parameters
    ----------
    name : str
        Name in the table of rigs.
    part : mapping
        Its part of a rig file, without a device: with :data:`ENVELOPE` as its
        envelope, and able to reach (0.5, 0.4, 1) m.

    Raises
    ------
    AssertionError
        If a promise is broken; names it.
    """
    for check in (_tells_who_it_is, _reaches, _refuses, _stays, _estimates):
        with homed(name, part) as rig:
            check(rig)


@contextmanager
def homed(name: str, part: Mapping[str, Any]) -> Iterator[Rig]:
    """Build a rig from its part of a rig file, home it, and close it in the end."""
    kind = RIGS[name]
    promise(kind.about, "a kind of rig says in a line what it is")
    config = kind.config.model_validate({"kind": name, **part})
    rig = kind.build(config, Surroundings(clock=VirtualClock(), ask=lambda _: True))
    rig.home()
    try:
        yield rig
    finally:
        rig.close()
        # Closing twice does no harm.
        rig.close()


def _tells_who_it_is(rig: Rig) -> None:
    promise(isinstance(rig, Rig), "it has all that the protocol rigs.Rig asks for")
    told = rig.describe()
    promise(told["name"] == rig.name, "`describe` tells its name")
    promise(told["simulated"] is rig.simulated, "`describe` tells if it is simulated")


def _reaches(rig: Rig) -> None:
    ways = ([], [Pose.at(0.3, 0.4, 1.0), Pose.at(0.7, 0.4, 1.0)])
    for via in ways:
        _is_at(rig.move(INSIDE, via=via), "`move` returns the pose reached")
        _is_at(rig.where(), "`where` answers the pose reached")


def _refuses(rig: Rig) -> None:
    rig.move(INSIDE)
    for words, pose in OUTSIDE.items():
        for call in (rig.check, rig.move):
            told = refusal(OutOfReachError, lambda call=call, pose=pose: call(pose))
            promise(words in told, f"a pose out of reach is refused with {words!r}")
    _is_at(rig.where(), "a refused pose moves nothing")
    if rig.describe()["kind"] == "manual":
        # A person sees the way and walks round the table.
        return
    past = [Pose.at(1.5, 0.4, 1.0)]
    beyond = Pose.at(0.6, 0.4, 1.0)
    refusal((OutOfReachError, RigError), lambda: rig.move(beyond, via=past))
    _is_at(rig.where(), "a bad way-point is refused before anything moves")


def _stays(rig: Rig) -> None:
    rig.move(INSIDE)
    with rig.quiet():
        pass
    rig.stop()
    _is_at(rig.where(), "`quiet` and `stop` leave it where it is")


def _estimates(rig: Rig) -> None:
    near = rig.duration(INSIDE, Pose.at(0.6, 0.4, 1.0))
    far = rig.duration(INSIDE, Pose.at(1.05, 0.4, 1.0))
    promise(0 <= near <= far, "a longer way takes no less time")
    promise(np.isfinite(far), "`duration` is a number")


def _is_at(pose: Pose | None, words: str) -> None:
    there = pose is not None and np.allclose(
        pose.position, INSIDE.position, rtol=0, atol=REACHED_M
    )
    promise(there, f"{words}: {INSIDE.position} m, not {pose}")
