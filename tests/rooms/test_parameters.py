"""Room-acoustic parameters against closed forms."""

import numpy as np
import pytest

from rir.errors import SignalError
from rooms import Scene, simulate
from rooms.parameters import hall_parameters

RATE, OCTAVES = 16000, np.array([250.0, 500, 1000, 2000, 4000])


def decay(t60, duration=2.0, delay=0.05, seed=0):
    """Return noise that decays exponentially from a delay on."""
    rng = np.random.default_rng(seed)
    n = round(duration * RATE)
    t = np.arange(n) / RATE - delay
    fall = np.where(t < 0, 0.0, 10 ** (-3 * np.maximum(t, 0) / t60))
    return rng.standard_normal((8, n)) * fall


@pytest.mark.parametrize("t60", [0.4, 1.2])
def test_an_exponential_decay_has_its_closed_form_parameters(t60):
    found = hall_parameters(decay(t60), RATE, np.full(8, 0.05), OCTAVES[2:])
    mean = {name: np.nanmean(values, axis=0) for name, values in found.items()}
    for name in ("EDT", "T20", "T30"):
        np.testing.assert_allclose(mean[name], t60, rtol=0.08)
    for ms, name in ((0.05, "C50"), (0.08, "C80")):
        left = 10 ** (-6 * ms / t60)
        np.testing.assert_allclose(mean[name], 10 * np.log10(1 / left - 1), atol=0.7)
    np.testing.assert_allclose(mean["D50"], 1 - 10 ** (-0.3 / t60), atol=0.04)
    np.testing.assert_allclose(mean["TS"], t60 / np.log(10) / 6, rtol=0.08)


def test_limits_of_close_places_count_from_the_direct_sound():
    response = np.zeros(4 * RATE // 10)
    response[[16, 16 + RATE // 20 + 8]] = 1.0, 0.5  # after 1 ms, and 50.5 ms later
    found = hall_parameters(response, RATE, 0.001, OCTAVES[-1:])
    np.testing.assert_allclose(found["C50"], 20 * np.log10(2), atol=0.2)
    same = hall_parameters(decay(0.4, delay=0.0), RATE, np.zeros(8), OCTAVES[2:])
    np.testing.assert_allclose(np.nanmean(same["T30"], axis=0), 0.4, rtol=0.08)


def test_strength_is_the_level_against_ten_metres_of_free_field():
    scene = Scene.shoebox((30, 30, 30), absorption=1.0)
    ends = [5, 15, 15], [[15, 15, 15], [7.5, 15, 15]]
    made = simulate(scene, *ends, sample_rate=RATE, duration=0.1, effects=["direct"])
    arrival = np.array([[10, 2.5]]) / scene.speed_of_sound
    found = hall_parameters(made.responses, RATE, arrival, OCTAVES)
    np.testing.assert_allclose(found["G"][0, 0], 0.0, atol=0.1)
    np.testing.assert_allclose(found["G"][0, 1], 20 * np.log10(4), atol=0.1)


def test_strength_of_a_reverberant_room_is_that_of_the_diffuse_field():
    scene = Scene.shoebox((9, 8, 7), absorption=0.1, scattering=0.5)
    far = [[7.6, 6.9, 5.4], [7.0, 1.2, 5.9], [1.1, 6.6, 5.5]]
    made = simulate(scene, [1.3, 1.2, 1.1], far, sample_rate=RATE, duration=2.5)
    way = np.linalg.norm(np.array(far) - [1.3, 1.2, 1.1], axis=1)
    found = hall_parameters(
        made.responses, RATE, way[None] / scene.speed_of_sound, OCTAVES[:2]
    )
    area = scene.geometry.areas.sum()
    field = 16 * np.pi * 0.9 / (0.1 * area) + 1 / way**2
    expected = 10 * np.log10(100 * field)
    np.testing.assert_allclose(found["G"].mean(), expected.mean(), atol=0.7)


def test_what_a_short_response_does_not_hold_is_not_given():
    found = hall_parameters(decay(1.2, 0.4), RATE, np.full(8, 0.05), [1000.0])
    assert np.isnan(found["T30"]).all()
    assert np.isnan(found["T20"]).all()
    np.testing.assert_allclose(np.nanmean(found["EDT"]), 1.2, rtol=0.15)
    high = hall_parameters(decay(1.2), RATE, np.full(8, 0.05), [8000.0])
    assert all(np.isnan(values).all() for values in high.values())


def test_a_response_that_ends_within_the_early_sound_has_no_clarity():
    response = np.exp(-np.arange(3360) / 300)  # 70 ms at 48 kHz
    found = hall_parameters(response[None], 48000, [0.0], [1000.0])
    assert np.isfinite(found["C50"]).all()
    assert np.isnan(found["C80"]).all()
    short = hall_parameters(response[None, :1200], 48000, [0.0], [1000.0])
    assert np.isnan([short["C50"], short["D50"], short["C80"]]).all()


def test_arrivals_must_match_the_responses():
    with pytest.raises(SignalError, match="need arrivals of shape"):
        hall_parameters(np.zeros((2, 100)), RATE, [0.1], [1000.0])
