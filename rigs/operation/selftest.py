"""A rig's self-test: random poses and back."""

from collections.abc import Callable

import numpy as np

from rigs.carriers import Carriers
from rir.errors import OutOfReachError, RigError
from rir.pose import Pose

TRIES = 2000  # finds a pair in 149 of 150 tests where 1 in 400 is allowed


def visit_random_poses(
    carriers: Carriers, count: int, seed: int, show: Callable[[str], None]
) -> float:
    """Visit random poses and the first of them again.

    Parameters
    ----------
    carriers
        Homed carriers.
    count
        Poses to visit.
    seed
        Of the poses.
    show
        Shows one line for each.

    Returns
    -------
    float
        Largest distance of a pose reached from the pose asked for, m.

    Raises
    ------
    RigError
        If a carrier does not arrive, or nothing can be visited.
    """
    rng = np.random.default_rng(seed)
    goals = [_draw(carriers, rng) for _ in range(count)]
    worst = 0.0
    for k, goal in enumerate([*goals, goals[0]]):
        reached = carriers.place(*goal)
        off = max(a.distance(b) for a, b in zip(goal, reached, strict=True))
        worst = max(worst, off)
        show(f"{k + 1}/{count + 1}: emitter {reached[0]}, listener {reached[1]}")
    return worst


def _draw(carriers: Carriers, rng: np.random.Generator) -> tuple[Pose, Pose]:
    for _ in range(TRIES):
        poses = []
        for rig, here in zip(carriers.rigs, carriers.where(), strict=True):
            if rig.envelope is None or here is None:
                raise RigError(f"{rig.name} has no envelope to draw poses from")
            point = rng.uniform(rig.envelope.low, rig.envelope.high)
            poses.append(Pose(point.round(3), here.orientation))
        try:
            carriers.check(poses[0], poses[1])
        except OutOfReachError:
            continue
        return poses[0], poses[1]
    raise RigError(f"no allowed pair of poses was found in {TRIES} tries")
