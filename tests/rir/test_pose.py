import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rir import Pose, Poses, SignalError
from rir.pose import rotate


def test_rotation_agrees_with_scipy() -> None:
    rng = np.random.default_rng(1)
    turns = Rotation.random(50, rng=rng)
    vectors = rng.normal(size=(50, 3))
    np.testing.assert_allclose(
        rotate(turns.as_quat(), vectors), turns.apply(vectors), atol=1e-12
    )


@pytest.mark.parametrize("target", [(1, 0, 0), (0, 2, 0), (-1, -1, 1), (0, 0, 3)])
def test_a_device_facing_a_target_looks_at_it(target: tuple[float, ...]) -> None:
    pose = Pose.facing([0.5, 0.5, 0.5], np.add(target, 0.5))
    np.testing.assert_allclose(
        pose.forward, np.array(target) / np.linalg.norm(target), atol=1e-12
    )


def test_local_direction_of_the_front_is_x() -> None:
    pose = Pose.at(1, 2, 3, yaw_deg=37, pitch_deg=-20)
    np.testing.assert_allclose(pose.to_local(pose.forward), [1, 0, 0], atol=1e-12)


def test_positive_pitch_looks_up() -> None:
    assert Pose.at(0, 0, 0, pitch_deg=30).forward[2] == pytest.approx(0.5)


def test_poses_come_from_any_usual_form() -> None:
    poses = [Pose.at(1, 2, 3), Pose.at(4, 5, 6, yaw_deg=90)]
    rows = [np.concatenate([p.position, p.orientation]) for p in poses]
    for things in (poses, np.array(rows), Poses.of(poses)):
        assert list(Poses.of(things)) == poses
    assert len(Poses.of([1.0, 2.0, 3.0])) == 1
    np.testing.assert_allclose(Poses.of(poses)[1:].forward, [[0, 1, 0]], atol=1e-12)


def test_bad_poses_are_refused_with_their_numbers() -> None:
    with pytest.raises(SignalError, match=r"shape \(3,\), not \(2,\)"):
        Pose(np.zeros(2))
    with pytest.raises(SignalError, match="unit quaternion; its norm is 2.0000"):
        Pose(np.zeros(3), np.array([0, 0, 0, 2.0]))
    with pytest.raises(SignalError, match="must be finite"):
        Pose(np.array([0, np.nan, 0]))
    with pytest.raises(SignalError, match=r"\(N, 3\) or \(N, 7\), not \(1, 5\)"):
        Poses.of(np.zeros(5))


@pytest.mark.parametrize(
    ("things", "told"),
    [
        ("abc", "not str 'abc'; give Pose"),
        ([[1, 2, "x"]], "not list"),
        ([[1, 2, 3], [1, 2]], "not list"),
        (np.ones(3) * 1j, "not complex"),
        ({"x": 1}, "not dict"),
        (object(), "not object"),
        ([1, 10**400, 3], "not list"),
        ([[1, None, 3]], "finite"),
        (None, r"shape \(3,\)"),
        (5.0, r"shape \(3,\)"),
        ([Pose.at(1, 1, 1), 3], "mixed"),
    ],
)
def test_what_are_no_poses_is_told_with_what_is(things: object, told: str) -> None:
    with pytest.raises(SignalError, match=told):
        Poses.of(things)


@pytest.mark.parametrize("number", ["1", None, np.nan, 1j, [1, 2], 10**400])
def test_a_coordinate_or_an_angle_that_is_no_number_is_told(number: object) -> None:
    with pytest.raises(SignalError, match=r"a coordinate \[m\]"):
        Pose.at(0, number, 0)  # pyright: ignore[reportArgumentType]
    with pytest.raises(SignalError, match="an angle"):
        Pose.at(0, 0, 0, yaw_deg=number)  # pyright: ignore[reportArgumentType]
    with pytest.raises(SignalError, match="target"):
        Pose.facing([0, 0, 0], number)  # pyright: ignore[reportArgumentType]


def test_many_wrong_coordinates_are_told_by_the_first() -> None:
    places = np.zeros((1000, 3))
    places[500:, 1] = np.nan
    with pytest.raises(SignalError, match="500 numbers") as told:
        Poses.of(places)
    assert len(str(told.value)) < 120
