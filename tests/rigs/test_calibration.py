import numpy as np
import pytest

from rigs import SimulatedRig
from rigs.calibration.frame import Frame, fit_frame
from rigs.calibration.repeatability import judge_approaches, run_approaches
from rigs.calibration.survey import direct_time, refine_places
from rir.errors import ConfigError, RigError
from rir.pose import Pose


def test_the_frame_is_recovered_from_noisy_points():
    rng = np.random.default_rng(0)
    errors = []
    for _ in range(200):
        axis = rng.normal(size=4)
        frame = Frame(rng.uniform(-3, 3, 3), axis / np.linalg.norm(axis))
        touched = rng.uniform([-2000, -2000, -1500], 0, (8, 3))
        surveyed = frame.to_room(touched) + rng.normal(0, 0.5e-3, (8, 3))
        found = fit_frame(touched, surveyed)
        centre = touched.mean(axis=0)
        off = found.frame.to_room(centre) - frame.to_room(centre)
        errors.append(np.linalg.norm(off))
        assert found.rms < 1.5e-3
    rms = np.sqrt(np.mean(np.square(errors)))
    # the centroid of n points is known to sigma sqrt(3 / n)
    assert rms == pytest.approx(0.5e-3 * np.sqrt(3 / 8), rel=0.15)


def test_frames_turn_both_ways():
    frame = Frame.at([1, 2, 3], yaw_deg=37)
    points = np.random.default_rng(1).normal(size=(5, 3))
    np.testing.assert_allclose(frame.to_room(frame.to_machine(points)), points)
    assert frame.yaw_deg == pytest.approx(37)


@pytest.mark.parametrize(
    ("points", "match"),
    [(np.eye(3)[:2], "at least 3"), ([[0, 0, 0], [1, 0, 0], [2, 0, 0]], "in a line")],
)
def test_unfit_points_are_refused(points, match):
    with pytest.raises(ConfigError, match=match):
        fit_frame(points, points)


def test_repeatability_is_reported_within_its_limits():
    rng = np.random.default_rng(2)
    reported = []
    for _ in range(300):
        below = rng.normal(0, 20e-6, 200)
        above = rng.normal(50e-6, 20e-6, 200)
        result = judge_approaches(below, above)
        reported.append(result.sigma)
        assert result.backlash == pytest.approx(50e-6, abs=12e-6)
    off = np.abs(np.array(reported) / 20e-6 - 1)
    assert np.mean(off < 0.1) > 0.98
    assert np.median(reported) == pytest.approx(20e-6, rel=0.02)


def test_the_routine_approaches_from_both_sides():
    ways = []

    class Watched(SimulatedRig):
        def move(self, pose, via=()):
            ways.append(float(via[0].position[0] - pose.position[0]))
            return super().move(pose, via)

    rng = np.random.default_rng(3)
    rig = Watched()
    result = run_approaches(
        rig,
        Pose.at(1, 1, 1),
        0,
        lambda: 1e-4 * (ways[-1] > 0) + float(rng.normal(0, 1e-5)),
        count=50,
    )
    np.testing.assert_allclose(np.abs(ways), 0.05)
    assert sum(way > 0 for way in ways) == 50
    assert result.backlash == pytest.approx(1e-4, abs=1e-5)
    assert result.low < 1e-5 < result.high
    with pytest.raises(RigError, match="at least 3"):
        judge_approaches([0.0], [0.0])


def test_places_are_refined_by_sound():
    rng = np.random.default_rng(4)
    true = rng.uniform(0, 4, (24, 3))
    links = [(i, j) for i in range(24) for j in range(i) if (i + j) % 2]
    i, j = np.array(links).T
    lengths = np.linalg.norm(true[i] - true[j], axis=1) + 0.012
    lengths = lengths + rng.normal(0, 0.5e-3, len(links))
    reported = true + rng.normal(0, 5e-3, true.shape)
    survey = refine_places(
        reported, links, lengths, place_sigma=5e-3, length_sigma=0.5e-3
    )
    before = reported - true
    after = survey.places - true
    # whole-body shifts and turns cannot be heard: judge the shape alone
    assert _shape_error(after, true) < 0.3 * _shape_error(before, true)
    assert survey.offset == pytest.approx(0.012, abs=2e-3)
    assert np.std(survey.residuals) < 0.6e-3


def _shape_error(off, true):
    columns = [np.tile(np.eye(3)[k], len(true)) for k in range(3)]
    columns += [np.cross(np.eye(3)[k], true).ravel() for k in range(3)]
    basis = np.array(columns).T
    rest = off.ravel() - basis @ np.linalg.lstsq(basis, off.ravel(), rcond=None)[0]
    return np.sqrt(np.mean(rest**2))


@pytest.mark.parametrize("delay", [100.0, 100.25, 411.73])
def test_direct_sound_is_found_between_samples(delay):
    n = np.arange(2048)
    response = np.sinc(n - delay) + 1.4 * np.sinc(n - delay - 90.5)
    assert direct_time(response, 48000) * 48000 == pytest.approx(delay, abs=0.02)
