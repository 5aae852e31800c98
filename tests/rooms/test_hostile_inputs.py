"""Whatever is passed in: a finite answer, or one error of the house."""

import numpy as np
import pytest

from rir import GainPattern, Pose
from rir.errors import ResoundingError
from rooms import Scene, plan_effects, simulate
from rooms.builtin import load_scene
from rooms.effects import Tolerance

HOSTILE = [
    None, "abc", "", b"x", np.nan, np.inf, -1, -1.5, 0, 1e300, 1e-300, 2**70, 10**400,
    True, 1j, [], [[]], {}, {"a": 1}, [1], [1, 2], [1, 2, "x"], [1, None, 3],
    [np.nan] * 3, [[1, 2, 3], [1, 2]], np.zeros((3, 3)), np.ones((2, 2, 2)), object(),
    {1, 2}, np.array(["a", "b", "c"]), np.ones(3) * 1j, Pose.at(1, 1, 1),
    GainPattern.omni(), np.datetime64("2020-01-01"), (x for x in (1, 2)),
]  # fmt: skip
LOT = [(0, 0), (3, 0), (3, 2), (0, 2)]
RUN = {"sample_rate": 4000, "duration": 0.01}
SHARES = ("absorption", "scattering")


def answers(make):
    """Call with every hostile value; return what it answered where it did."""
    made, told = [], []
    for value in HOSTILE:
        try:
            made.append(make(value))
        except ResoundingError as error:
            told.append(str(error))
    assert all(15 < len(message) < 1500 for message in told)
    return made


def box(**changes):
    return Scene.shoebox((3, 2.5, 2.2), **changes)


@pytest.mark.parametrize(
    "make",
    [
        Scene.shoebox,
        lambda value: box(absorption=value),
        lambda value: box(absorption={"all": 0.1, "floor": value}),
        lambda value: box(air=value),
        lambda value: box(emitter_gain=value),
        lambda value: box(hardware=value),
        lambda value: box(emitter_speed=value),
        lambda value: box(nonsense=value),
        lambda value: Scene.extruded(value, 2.5),
        lambda value: Scene.extruded(LOT, value),
        lambda value: Scene.extruded(LOT, 2.5, value),
        lambda value: Scene.extruded(LOT, 2.5, {"all": value}),
        lambda value: Scene.extruded(
            LOT, 2.5, {"all": {"absorption": 0.5, "transmission": value}}
        ),
        Scene.from_mesh,
        Scene.from_room,
        load_scene,
    ],
)
def test_scenes_are_made_whole_or_refused(make):
    for scene in answers(make):
        for shares in (scene.absorption, scene.scattering, scene.transmission):
            assert np.all((shares >= 0) & (shares <= 1))
        assert 0 < scene.geometry.volume < np.inf


@pytest.mark.parametrize(
    "name",
    [
        "sample_rate", "duration", "max_order", "rays", "effects", "accuracy",
        "seconds", "rng", "seed", "threads", "plan", "dtype", "emitters", "listeners",
    ],
)  # fmt: skip
def test_responses_are_finite_or_the_option_is_refused(name):
    def run(value):
        given = {**RUN, "emitters": [1, 1, 1], "listeners": [2, 1, 1], "max_order": 1}
        return simulate(box(), **{**given, name: value}).responses

    for responses in answers(run):
        assert np.isfinite(responses).all()


@pytest.mark.parametrize("name", ["only", "without", "tolerance", "everything", "rays"])
def test_plans_are_made_or_the_option_is_refused(name):
    answers(lambda value: plan_effects(box(), **RUN, **{name: value}))


def test_scenes_and_tolerances_that_are_none_are_refused():
    assert answers(lambda value: simulate(value, [1, 1, 1], [2, 1, 1], **RUN)) == []
    assert answers(plan_effects) == []
    for tolerance in answers(Tolerance):
        assert tolerance.level_db >= 0


@pytest.mark.parametrize(
    "text",
    [
        "v 1 2", "v a b c\nf 1 2 3", "f 1 2 3", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9", "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3",
        "v 1e300 0 0\nv 1 0 0\nv 0 1e300 0\nf 1 2 3", "", "\x00\x01",
    ],
)  # fmt: skip
def test_broken_mesh_files_are_refused(tmp_path, text):
    (tmp_path / "room.obj").write_text(text)
    with pytest.raises(ResoundingError):
        Scene.from_mesh(tmp_path / "room.obj", 0.2)
