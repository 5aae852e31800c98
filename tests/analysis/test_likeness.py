"""Fits between the directions, and the naming of faults."""

import numpy as np
import pytest

from analysis.likeness import fit_room, fit_swap, position_error, warped
from analysis.likeness.floor import predicted_floor
from analysis.likeness.octaves import octave_envelopes
from hard_cases.trials import FAULT_KINDS, TrialBox, trial_session
from rir.physics import STRETCH_PER_KELVIN

BOX = TrialBox(sample_rate=16000, duration=0.2)


@pytest.fixture(scope="module")
def pair():
    a, b = np.array([1.0, 1.2, 1.1]), np.array([3.9, 2.8, 1.7])
    return BOX, a, b, BOX.response(a, b)


def test_swapped_ends_give_the_same_response(pair):
    box, a, b, h = pair
    np.testing.assert_allclose(box.response(b, a), h, atol=1e-12)


def test_octaves_keep_the_energy():
    h = np.random.default_rng(0).standard_normal(8000)
    bands = octave_envelopes(h, 16000, [500.0, 1000.0, 2000.0])
    spectrum = np.abs(np.fft.rfft(h)) ** 2
    frequency = np.fft.rfftfreq(8000, 1 / 16000)
    inside = (frequency > 500 / 2**0.5) & (frequency < 2000 * 2**0.5)
    kept = sum(np.sum(np.abs(b.values) ** 2) / b.rate for b in bands)
    np.testing.assert_allclose(
        2 * kept, 2 * spectrum[inside].sum() / 8000 / 16000, rtol=0.05
    )


@pytest.mark.parametrize("kelvin", [-0.5, 0.05, 0.3, 1.0])
def test_temperature_is_found_from_the_stretch(pair, kelvin):
    box, a, b, h = pair
    warm = box.response(b, a, 20.0 + kelvin)
    fit = fit_swap(h, warm, box.sample_rate)
    np.testing.assert_allclose(fit.temperature_change, kelvin, atol=0.02)
    assert np.nanmedian(fit.matched) > 0.995


def test_gain_and_delay_are_found(pair):
    box, _, _, h = pair
    other = 10 ** (0.5 / 20) * warped(h, box.sample_rate, 0.0, 20e-6)
    fit = fit_swap(h, other, box.sample_rate)
    np.testing.assert_allclose(fit.gain_db, 0.5, atol=0.01)
    np.testing.assert_allclose(fit.delay, 20e-6, atol=1e-6)
    np.testing.assert_allclose(fit.temperature_change, 0, atol=0.01)


def test_displacement_is_measured_from_what_is_left(pair):
    box, a, b, h = pair
    found = []
    for axis in np.eye(3):
        fit = fit_swap(h, box.response(b + 0.01 * axis, a), box.sample_rate)
        found.append(position_error(fit))
    np.testing.assert_allclose(np.mean(found), 0.01, rtol=0.4)


def test_faults_are_named():
    rng = np.random.default_rng(3)
    faults = {1: "gain", 3: "position", 5: "temperature", 7: "swapped", 9: "noise"}
    assert set(faults.values()) == set(FAULT_KINDS)
    session = trial_session(11, faults, rng, box=BOX)
    samples = np.asarray(session.responses[:])
    names = [str(k) for k in range(11)]
    room = fit_room(list(samples[:11]), list(samples[11:]), names, BOX.sample_rate)
    kinds = {k: f[0].kind for k, f in enumerate(room.faults) if f}
    assert kinds == faults | {8: "swapped"}
    assert "belongs to pair 8" in room.faults[7][0].words


def test_unequal_patterns_are_told_from_displaced_ends():
    session = trial_session(6, {}, np.random.default_rng(0), directional=True, box=BOX)
    samples = np.asarray(session.responses[:])
    room = fit_room(list(samples[:6]), list(samples[6:]), list("abcdef"), 16000)
    assert room.share("pattern") > 0.6


def whole_decay():
    box = TrialBox(sample_rate=16000, duration=0.5)
    return box.response(np.array([1.0, 1.2, 1.1]), np.array([3.9, 2.8, 1.7]))


def test_floor_grows_with_noise_temperature_and_places():
    h = whole_decay()
    rng = np.random.default_rng(0)
    noisy = [h + s * rng.standard_normal(len(h)) for s in (1e-4, 1e-3)]

    def floor(response, warming=0.0, place=0.0):
        return predicted_floor(
            [response],
            [response],
            16000,
            np.random.default_rng(1),
            flavour="paper",
            symbols=["Env"],
            temperature_changes=[warming],
            position_m=place,
        )["Env"]

    quiet = floor(noisy[0])
    assert quiet < 0.2 * floor(noisy[1])
    assert quiet < 0.5 * floor(noisy[0], warming=0.3)
    assert quiet < 0.5 * floor(noisy[0], place=0.002)


def test_predicted_floor_agrees_with_a_session_that_only_has_noise():
    rng = np.random.default_rng(5)
    h = whole_decay()
    a, b = (h + 1e-3 * rng.standard_normal(len(h)) for _ in range(2))
    floors = predicted_floor(
        [a],
        [b],
        16000,
        rng,
        flavour="paper",
        symbols=["Env", "STFT"],
        temperature_changes=[float("nan")],
        position_m=0.0,
    )
    from analysis import paper_metrics

    measured = paper_metrics(a, b, 16000)
    for symbol, value in floors.items():
        np.testing.assert_allclose(value, measured[symbol], rtol=0.25)


def test_stretch_of_a_kelvin():
    np.testing.assert_allclose(STRETCH_PER_KELVIN, 0.001706, rtol=1e-3)


def test_faults_are_named_in_the_simulated_kitchen_too():
    from rir import Pose
    from rooms import World
    from rooms.presets import load_room

    kitchen = load_room("kitchen")
    a, b = Pose.at(1.0, 1.2, 1.1), Pose.at(3.2, 2.4, 1.6)
    cold, warm = (
        World(kitchen, sample_rate=32000, duration=0.4, temperature_c=t)
        for t in (20.0, 20.3)
    )
    fit = fit_swap(cold.response(a, b), warm.response(b, a), 32000)
    np.testing.assert_allclose(fit.temperature_change, 0.3, atol=0.04)
    moved = Pose.at(3.2, 2.405, 1.6)
    fit = fit_swap(cold.response(a, b), cold.response(moved, a), 32000)
    np.testing.assert_allclose(position_error(fit), 0.005, rtol=0.5)
