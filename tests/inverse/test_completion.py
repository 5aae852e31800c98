"""The completion: untouched where paths explain, symmetric, finite, and it tells."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from inverse.late.coherence_horizon import (
    Uncertainty,
    predicted_coherence,
)
from inverse.late.completion import Completion
from inverse.late.even_tail import even_noise
from inverse.rows.fitset import FitSet, place_numbers
from inverse.rows.tiles import Tiles
from rir import Poses

RATE, LENGTH, SPEED = 16000.0, 1600, 343.0


def fit_set(count=80, places=4, length=LENGTH, seed=0, responses=None):
    rng = np.random.default_rng(seed)
    emitters = rng.uniform([0.5, 0.5, 1], [5, 3.5, 2], (places, 3))
    emitters = np.repeat(emitters, -(-count // places), axis=0)[:count]
    listeners = rng.uniform([0.5, 0.5, 1], [5, 3.5, 2], (count, 3))
    distances = np.linalg.norm(emitters - listeners, axis=1)
    if responses is None:
        times = np.arange(length) / RATE
        responses = rng.standard_normal((count, length)) * np.exp(-30 * times) * 0.1
        responses[times < (distances / SPEED)[:, None]] = 0
        index = np.rint(distances / SPEED * RATE).astype(int)
        inside = index < length
        responses[np.flatnonzero(inside), index[inside]] = 1 / distances[inside]
    return FitSet(
        np.asarray(responses, dtype=float),
        Poses.of(emitters),
        Poses.of(listeners),
        RATE,
        SPEED,
        place_numbers(emitters),
        np.zeros(count, dtype=np.int64),
    )


def test_octaves_add_up_and_unit_gains_change_nothing():
    tiles = Tiles(RATE, LENGTH)
    sound = np.random.default_rng(0).standard_normal((3, LENGTH))
    assert_allclose(tiles.split(sound).sum(axis=1), sound, atol=1e-12)
    ones = np.ones((3, len(tiles.centers), tiles.bins))
    assert_array_equal(tiles.gained(sound, ones), sound)
    assert_allclose(tiles.gained(sound, 2 * ones), 2 * sound, atol=1e-12)


def test_paths_that_explain_come_back_untouched():
    rows = fit_set()
    wrong = 1e-3 * np.random.default_rng(1).standard_normal(rows.responses.shape)
    early = rows.responses * (1 + wrong)
    completion = Completion.fit(rows, early, None)
    told = completion.apply(early, rows.emitters, rows.listeners)
    change = ((told - early) ** 2).sum() / (early**2).sum()
    assert change < 1e-5


def test_paths_that_explain_a_part_are_completed_in_both_directions():
    rows = fit_set(120)
    early = rows.responses.copy()
    early[:, 400:] *= np.random.default_rng(3).choice([-1.0, 1.0], (120, 1200))
    completion = Completion.fit(rows, early, None)
    there = completion.apply(early, rows.emitters, rows.listeners)
    back = completion.apply(early, rows.listeners, rows.emitters)
    assert np.isfinite(there).all()
    assert_array_equal(there, back)
    gap = there[:, :300] - rows.responses[:, :300]
    assert (gap**2).sum() < 0.02 * (rows.responses[:, :300] ** 2).sum()


def test_a_wrong_level_of_good_paths_is_mended():
    rows = fit_set()
    completion = Completion.fit(rows, 0.7 * rows.responses, None)
    told = completion.apply(0.7 * rows.responses, rows.emitters, rows.listeners)
    gap = ((told - rows.responses) ** 2).sum() / (rows.responses**2).sum()
    assert gap < 1e-3


def test_swapped_ends_are_told_the_same_bits():
    rows = fit_set()
    early = np.zeros_like(rows.responses)
    completion = Completion.fit(rows, early, None)
    there = completion.apply(early, rows.emitters, rows.listeners)
    back = completion.apply(early, rows.listeners, rows.emitters)
    assert np.abs(there).max() > 0
    assert_array_equal(there, back)


def test_without_paths_energies_are_told_and_the_alarm_is_raised():
    rows = fit_set(120)
    completion = Completion.fit(rows, np.zeros_like(rows.responses), None)
    fresh = fit_set(60, seed=7)
    told = completion.apply(
        np.zeros_like(fresh.responses), fresh.emitters, fresh.listeners
    )
    late = slice(480, None)
    level = np.log10(
        (told[:, late] ** 2).sum(1) / (fresh.responses[:, late] ** 2).sum(1)
    )
    assert abs(10 * level.mean()) < 0.5
    assert any("do not explain" in one for one in completion.alarms)


@pytest.mark.parametrize(
    ("count", "length"), [(1, 160), (2, 160), (4, 1), (4, 7), (8, 1600)]
)
@pytest.mark.parametrize("loudness", [0.0, 1e-9, 1e6])
def test_hard_cases_stay_finite(count, length, loudness):
    rows = fit_set(count, min(count, 2), length)
    rows = fit_set(count, min(count, 2), length, responses=loudness * rows.responses)
    early = np.zeros_like(rows.responses)
    completion = Completion.fit(rows, early, None)
    told = completion.apply(early, rows.emitters, rows.listeners)
    assert np.isfinite(told).all()
    if loudness == 0.0:
        assert not told.any()


def test_a_stored_completion_tells_the_same(tmp_path):
    rows = fit_set()
    early = np.zeros_like(rows.responses)
    completion = Completion.fit(rows, early, None)
    kept = completion.as_arrays()
    np.savez(tmp_path / "one.npz", **kept)  # pyright: ignore[reportArgumentType]
    with np.load(tmp_path / "one.npz", allow_pickle=False) as stored:
        again = Completion.from_arrays(dict(stored))
    assert again.alarms == completion.alarms
    assert_array_equal(
        completion.apply(early, rows.emitters, rows.listeners),
        again.apply(early, rows.emitters, rows.listeners),
    )


def test_even_noise_swings_less_than_noise():
    noise = even_noise(4000, RATE, seed=0)
    frames = np.lib.stride_tricks.sliding_window_view(noise, 150)[::30]
    level = np.abs(np.fft.rfft(frames * np.hanning(150)))[:, 3:-3]
    assert level.std() / level.mean() < 0.4  # 0.52 in noise
    assert_allclose(noise.std(), 1.0, atol=0.05)


def test_coherence_follows_the_closed_form():
    uncertainty = Uncertainty(pose_sd_m=0.003, temperature_sd_k=0.5)
    times = np.array([0.0, 0.1])
    wave = 2 * np.pi * 2000 / SPEED
    variance = 2 * 0.003**2 + (0.0018 * 0.5 * SPEED * times) ** 2
    found = predicted_coherence(np.array([2000.0]), times, SPEED, uncertainty)
    assert_allclose(found[0], np.exp(-(wave**2) * variance), rtol=1e-12)
