"""What every kind of rig in the table must do."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from rigs import RIGS, Rig, Surroundings, VirtualClock
from rir.errors import OutOfReachError, RigError
from rir.pose import Pose

ENVELOPE = {
    "low_m": [0, 0, 0],
    "high_m": [2, 2, 2],
    "keep_outs": [{"name": "table", "low_m": [1.2, 0, 0], "high_m": [2, 2, 1.2]}],
    "clearance_m": 0.1,
}
DIALOGUE = {
    "dialogue": yaml.safe_load(Path(__file__).with_name("turntable.yaml").read_text())
}
EXAMPLES = {
    "simulated": {"envelope": ENVELOPE},
    "manual": {"envelope": ENVELOPE},
    "grbl": {
        "port": "simulated",
        "envelope": ENVELOPE,
        "frame": {"origin_m": [2.5, 2.5, 2.1]},
        "free_orientation": True,
    },
    "marlin": {
        "port": "simulated",
        "envelope": ENVELOPE,
        "free_orientation": True,
        "board": {"high_mm": [2000, 2000, 2000], "feed_mm_per_min": 9000},
    },
    "turntable": {
        "port": "simulated",
        "envelope": ENVELOPE,
        "stage": {"axis": "x", "low": 0, "high": 2000, "speed": 200, **DIALOGUE},
        "fixed": {"y": 400, "z": 1000},
    },
    "composite": {
        "envelope": ENVELOPE,
        "frame": {"origin_m": [2.5, 2.5, 2.1]},
        "parts": [
            {"kind": "grbl", "port": "simulated"},
            {"kind": "turntable", "port": "simulated", "stage": DIALOGUE},
        ],
    },
}
INSIDE = Pose.at(0.5, 0.4, 1.0)


def build(name):
    kind = RIGS[name]
    around = Surroundings(clock=VirtualClock(), ask=lambda _: True)
    built = kind.build(kind.config.model_validate(EXAMPLES[name]), around)
    built.home()
    return built


@pytest.fixture(params=list(RIGS))
def rig(request):
    built = build(request.param)
    yield built
    built.close()
    built.close()


def test_every_kind_has_an_example():
    assert set(EXAMPLES) == set(RIGS)


def test_it_is_a_rig(rig):
    assert isinstance(rig, Rig)
    assert rig.describe()["name"] == rig.name
    assert rig.describe()["simulated"] is rig.simulated


def test_move_returns_the_pose_reached(rig):
    reached = rig.move(INSIDE)
    np.testing.assert_allclose(reached.position, INSIDE.position, atol=1e-4)
    np.testing.assert_allclose(rig.where().position, INSIDE.position, atol=1e-4)


def test_way_points_are_accepted(rig):
    reached = rig.move(INSIDE, via=[Pose.at(0.3, 0.4, 1.0), Pose.at(0.7, 0.4, 1.0)])
    np.testing.assert_allclose(reached.position, INSIDE.position, atol=1e-4)


@pytest.mark.parametrize(
    ("pose", "match"),
    [
        (Pose.at(9, 0.4, 1.0), "7.000 m beyond the x reach"),
        (Pose.at(1.5, 0.4, 1.0), "keep-out 'table'"),
        (Pose.at(1.15, 0.4, 1.0), "0.050 m from keep-out 'table'"),
    ],
)
def test_out_of_reach_moves_nothing(rig, pose, match):
    rig.move(INSIDE)
    for call in (rig.check, rig.move):
        with pytest.raises(OutOfReachError, match=match):
            call(pose)
    np.testing.assert_allclose(rig.where().position, INSIDE.position, atol=1e-4)


def test_a_bad_way_point_is_refused_before_anything_moves(rig):
    if rig.describe()["kind"] == "manual":
        return
    rig.move(INSIDE)
    with pytest.raises((OutOfReachError, RigError)):
        rig.move(Pose.at(0.6, 0.4, 1.0), via=[Pose.at(1.5, 0.4, 1.0)])
    np.testing.assert_allclose(rig.where().position, INSIDE.position, atol=1e-4)


@pytest.mark.parametrize("name", ["grbl", "marlin", "composite"])
def test_a_machine_refuses_the_straight_way_through_a_keep_out(name):
    rig = build(name)
    before, beyond = Pose.at(1.05, 0.4, 0.2), Pose.at(1.8, 0.4, 1.35)
    above = Pose.at(1.05, 0.4, 1.35)
    rig.move(before, via=[INSIDE])
    for via in ([], [before]):
        with pytest.raises(OutOfReachError, match=r"straight way .*'table'"):
            rig.move(beyond, via=via)
        here = rig.where()
        assert here is not None
        np.testing.assert_allclose(here.position, before.position, atol=1e-4)
    reached = rig.move(beyond, via=[above])
    np.testing.assert_allclose(reached.position, beyond.position, atol=1e-4)
    rig.close()


def test_quiet_and_stop_leave_it_where_it_is(rig):
    rig.move(INSIDE)
    with rig.quiet():
        pass
    rig.stop()
    np.testing.assert_allclose(rig.where().position, INSIDE.position, atol=1e-4)


def test_duration_grows_with_the_way(rig):
    near = rig.duration(INSIDE, Pose.at(0.6, 0.4, 1.0))
    far = rig.duration(INSIDE, Pose.at(1.05, 0.4, 1.0))
    assert 0 <= near <= far
    assert np.isfinite(far)
