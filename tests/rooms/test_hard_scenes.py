"""Scenes that break simulators: finite, or one clear error."""

from typing import Any

import numpy as np
import pytest

from rir import GainPattern, Pose, Poses
from rir.errors import SceneError, SignalError
from rooms import Scene, plan_effects, simulate
from rooms.sound import Budget, Lattice, Sound
from rooms.synthesis import render

OUTLINE = np.array([(0, 0), (4, 0), (4, 1.6), (2, 1.6), (2, 3), (0, 3)])
RUN = {"sample_rate": 8000, "duration": 0.06, "rays": 200}


def lot(scale=1.0, height=2.5, **changes):
    shares = {"absorption": 0.3, "scattering": 0.2}
    return Scene.extruded(OUTLINE * scale, height, {"all": shares}, **changes)


@pytest.mark.parametrize(
    "ends",
    [
        ([1, 1, 1], [1, 1, 1]),
        ([0, 1, 1], [1, 1, 1]),
        ([2, 1.6, 1], [1, 1, 1]),
        ([0.1, 2.9, 1], [3.9, 0.1, 1]),
        ([2, 1.6, 1], [2, 1.6, 1]),
    ],
    ids=["coincident", "on a wall", "on an edge", "out of sight", "both on an edge"],
)
def test_awkward_places_are_finite(ends):
    assert np.isfinite(simulate(lot(), *ends, **RUN).responses).all()


@pytest.mark.parametrize("absorption", [0.0, 1.0])
def test_extreme_absorption_is_finite(absorption):
    scene = Scene.extruded(OUTLINE, 2.5, {"all": {"absorption": absorption}})
    assert np.isfinite(simulate(scene, [1, 1, 1], [3, 1, 1], **RUN).responses).all()


def test_tiny_and_huge_rooms_are_finite():
    small = simulate(
        lot(1 / 250, 0.01), [0.002, 0.003, 0.005], [0.008, 0.002, 0.004],
        sample_rate=48000, duration=0.002,
    )  # fmt: skip
    big = simulate(lot(25, 40), [20, 30, 5], [80, 20, 4], **RUN)
    fast = simulate(
        lot(), [1, 1, 1], [3, 1, 1], sample_rate=192000, duration=0.01, rays=100
    )
    for result in (small, big, fast):
        assert np.isfinite(result.responses).all()


def test_an_open_mesh_with_flaws_is_finite_and_tells_them():
    from rooms.mesh import MeshGeometry

    corners = [[0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0], [0, 0, 2.5], [4, 0, 2.5]]
    faces = [[0, 1, 2], [0, 2, 3], [0, 1, 5], [0, 5, 4], [0, 1, 2], [0, 0, 1]]
    scene = Scene.of_geometry(MeshGeometry.from_arrays(corners, faces), 0.2)
    told = " ".join(scene.remarks)
    assert "without an area" in told
    assert "open edges" in told
    assert np.isfinite(simulate(scene, [1, 1, 1], [3, 1, 1], **RUN).responses).all()


def test_no_gain_towards_the_listener_is_silence_not_a_fault():
    scene = lot(emitter_gain=GainPattern.first_order(0.0))
    ends = Pose.at(1, 1, 1, yaw_deg=90), Pose.at(1.8, 1, 1)
    result = simulate(scene, *ends, effects=["patterns", "direct"], **RUN)
    assert np.abs(result.responses).max() < 1e-12


def test_nobody_there_is_an_empty_answer():
    nobody = np.empty((0, 3))
    assert simulate(lot(), [1, 1, 1], nobody, **RUN).responses.shape == (1, 0, 480)
    assert simulate(lot(), nobody, [1, 1, 1], **RUN).responses.shape == (0, 1, 480)


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"rays": 0}, SignalError, "number of rays must be 1 or more, not 0"),
        ({"max_order": -1}, SignalError, "order must be 0 or more"),
        ({"sample_rate": 8000.5}, SignalError, "whole Hz"),
        (
            {"duration": float("nan")},
            SignalError,
            r"duration \[s\] must be one number above 0",
        ),
    ],
)
def test_mistakes_are_told_before_work_begins(changes, error, message):
    with pytest.raises(error, match=message):
        simulate(lot(), [1, 1, 1], [3, 1, 1], **{**RUN, **changes})


def test_places_outside_are_told():
    with pytest.raises(SceneError, match="outside"):
        simulate(lot(), [3, 2.5, 1], [1, 1, 1], **RUN)


def test_materials_are_checked():
    with pytest.raises(SceneError, match="no material is stated for"):
        Scene.extruded(OUTLINE, 2.5, {"floor": 0.1})
    with pytest.raises(SceneError, match="no surface 'roof'"):
        Scene.extruded(OUTLINE, 2.5, {"roof": 0.1, "all": 0.2})
    with pytest.raises(SceneError, match="transmission cannot exceed"):
        Scene.extruded(OUTLINE, 2.5, {"all": {"absorption": 0.1, "transmission": 0.2}})


def test_any_seed_will_do():
    one = simulate(lot(), [1, 1, 1], [3, 1, 1], seed=-3, **RUN).responses
    two = simulate(lot(), [1, 1, 1], [3, 1, 1], seed=-3, **RUN).responses
    drawn = simulate(
        lot(), [1, 1, 1], [3, 1, 1], rng=np.random.default_rng(5), **RUN
    ).responses
    np.testing.assert_array_equal(one, two)
    assert not np.array_equal(one, drawn)


def test_more_images_than_anyone_waits_for_are_refused():
    scene = Scene.shoebox([0.01, 0.01, 0.01], absorption=0.0)
    places = [0.005, 0.005, 0.005], [0.003, 0.004, 0.003]
    with pytest.raises(SceneError, match="highest order"):
        simulate(scene, *places, sample_rate=8000, duration=0.1)
    made = simulate(scene, *places, sample_rate=8000, duration=0.1, max_order=20)
    assert np.all(np.isfinite(made.responses))


def test_shares_that_are_no_numbers_are_refused():
    with pytest.raises(SceneError, match="0…1"):
        Scene.shoebox((6, 5, 3), absorption=np.nan)


def test_images_far_below_hearing_are_not_listed_and_change_nothing(monkeypatch):
    from rooms.effects import specular

    scene = Scene.shoebox((0.3, 0.25, 0.2), absorption={"all": 0.6, "x0": 1.0})
    ends = [0.1, 0.1, 0.1], [0.2, 0.14, 0.13]
    run = {"sample_rate": 8000, "duration": 0.15}
    made = simulate(scene, *ends, **run).responses
    monkeypatch.setattr(specular, "_silent_after", lambda *_: np.inf)
    whole = simulate(scene, *ends, **run).responses
    np.testing.assert_allclose(made, whole, rtol=0, atol=1e-7 * np.abs(whole).max())


def test_a_centimetre_room_with_any_loss_is_simulated():
    scene = Scene.shoebox([0.01, 0.01, 0.01], absorption=0.3)
    places = [0.005, 0.005, 0.005], [0.003, 0.004, 0.003]
    made = simulate(scene, *places, sample_rate=48000, duration=0.1).responses
    assert np.isfinite(made).all()
    # it has fallen silent long before the end
    assert np.abs(made[..., 2400:]).max() < 1e-9 * np.abs(made).max()


@pytest.mark.parametrize("order", [None, 1])
def test_images_that_end_before_they_would_fade_keep_to_their_rows(order):
    # lists that fell silent, or were cut by order, once faded rows of other memory
    scene = Scene.shoebox([0.3, 0.3, 0.3], absorption=0.5, scattering=0.3)
    places = [0.1, 0.15, 0.15], [0.2, 0.14, 0.13]
    sound = Sound(
        scene,
        Pose.at(*places[0]),
        Poses.of([Pose.at(*places[1])]),
        Budget(16000, 1600, order),
    )
    sound.lattice = Lattice(
        scene.geometry.size, sound.reflection, order or 9, 0.02, 1, 0.03
    )
    early = render(sound)[0]
    sound.lattice = Lattice(scene.geometry.size, sound.reflection, order or 9, 0.02)
    whole = render(sound)[0]
    assert np.isfinite(early).all()
    assert np.sum(early**2) <= np.sum(whole**2)


def test_plans_warn_of_boxes_that_hold_too_many_images():
    budget: Any = {"sample_rate": 16000, "duration": 0.5}
    tiny = plan_effects(Scene.shoebox((0.01, 0.01, 0.01), absorption=0.1), **budget)
    plain = plan_effects(Scene.shoebox((6, 5, 3), absorption=0.1), **budget)
    assert "s of work a pair" in tiny.verdicts["specular"].reason
    assert tiny.verdicts["specular"].cost_s > 1
    assert "s of work a pair" not in plain.verdicts["specular"].reason
