# pyright: reportOptionalMemberAccess=false
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from inverse.acoustics import Acoustics
from inverse.find import _room_alarms, room_in_rows
from inverse.paths.bank import PulseBank, ideal_bank
from inverse.paths.box_fit import BoxStep, _active, _sums
from inverse.paths.room import OMNI, BoxRoom
from inverse.search import SearchSettings
from path_rooms import level_errors

WALLS = np.array([0.9, 0.8, 0.85, 0.8, 0.7, 0.85])


@pytest.fixture(scope="module")
def heard(box_set):
    return room_in_rows(box_set)


def predicted(acoustics, rows):
    return acoustics.predict(rows.emitters, rows.listeners, rows.n_samples)


def test_unseen_emitters_are_told_to_forty_decibels(heard, unseen_set):
    errors = level_errors(unseen_set.responses, predicted(heard, unseen_set))
    assert np.median(errors) < -40
    assert not heard.alarms


def test_a_box_that_leaves_a_third_unexplained_is_not_called_one(heard):
    assert not _room_alarms(heard.fitted, 0.01)
    alarms = _room_alarms(heard.fitted, 0.34)
    assert any("not a box" in one for one in alarms)


def test_walls_and_pattern_are_the_true_ones(heard):
    room = heard.fitted.room
    assert_allclose(room.walls, WALLS, atol=0.003)
    assert_allclose(room.box.planes[:, 3], [0, -5, 0, -4, 0, -2.8], atol=5e-4)
    angles = np.linspace(0, np.pi, 19)
    ring = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    gain = heard.emitter_gain().gain(ring)[:, 0]
    assert_allclose(gain / 2, 0.5 + 0.5 * np.cos(angles), atol=0.01)


def test_latency_and_speed_are_fitted(make_box_rows):
    rows = make_box_rows(emitters=3, listeners=25, latency=33)
    room = room_in_rows(rows).fitted.room
    assert_allclose(room.latency_s * rows.sample_rate, 33, atol=0.05)
    assert_allclose(room.speed_of_sound, 343.2, atol=0.05)


def test_exchanging_ends_changes_nothing(heard, unseen_set):
    # with equal devices the two directions are one response
    room = heard.fitted.room
    both = np.array([3.0, 0.1, -0.4, 1.2])
    same = replace(room, emitting=both, listening=both)
    ends = unseen_set.emitters, unseen_set.listeners
    one = same.render(*ends, unseen_set.n_samples)
    other = same.render(*ends[::-1], unseen_set.n_samples)
    gap = np.abs(one - other).max() / np.abs(one).max()
    assert gap < 1e-12


def test_comes_back_from_arrays(heard, unseen_set):
    again = Acoustics.from_arrays(heard.as_arrays())
    assert_array_equal(predicted(again, unseen_set), predicted(heard, unseen_set))


def test_few_rows_are_answered_by_the_nearest(box_set):
    few = box_set.rows(np.arange(4))
    heard = room_in_rows(few)
    assert heard.fitted is None
    assert "too few" in heard.alarms[0]
    assert_allclose(predicted(heard, few), few.responses, rtol=1e-6, atol=1e-7)


def test_derivatives_are_those_of_the_rendering(box_set, centred_box):
    rows = box_set.rows(np.array([0, 40, 80]))
    emitting = np.array([1.8])
    room = BoxRoom(
        centred_box,
        343.2,
        1e-3,
        WALLS,
        emitting,
        OMNI,
        ideal_bank(48, 0.5),
        16000.0,
        order=2,
    )
    active = _active(room, BoxStep(4000.0, 2, 1))
    weights = np.ones(len(rows))
    _, right, start = _sums(rows, room, active, rows.responses, weights)
    from inverse.paths.box_fit import _errors, _moved

    sizes = np.concatenate([[1e-5] * 9, [1e-3, 1e-8], [1e-5] * 6, [1e-5]])
    for k, size in enumerate(sizes):
        step = np.zeros(len(sizes))
        step[k] = size
        up = _errors(rows, _moved(room, step), rows.responses).sum()
        down = _errors(rows, _moved(room, -step), rows.responses).sum()
        slope = (up - down) / (2 * size)
        # how walls change the level 1/length is left out on purpose
        loose = 0.04 if k < 9 else 1e-5
        assert_allclose(slope, -2 * right[k], rtol=1e-4, atol=loose * start.sum())


def test_one_emitter_is_enough(make_box_rows, unseen_set):
    heard = room_in_rows(make_box_rows(emitters=1, listeners=100))
    errors = level_errors(unseen_set.responses, predicted(heard, unseen_set))
    assert np.median(errors) < -40


def test_spreads_hold_the_errors_of_noisy_fits(make_box_rows):
    rows = make_box_rows(emitters=5, listeners=30)
    noise = np.random.default_rng(3).standard_normal(rows.responses.shape)
    noise *= 0.03 * np.sqrt((rows.responses**2).mean())
    told = room_in_rows(
        replace(rows, responses=rows.responses + noise), SearchSettings(late=False)
    )
    found = told.report()
    planes, middle = np.array(found["planes"]), np.array([2.5, 2.0, 1.4])
    depths = planes[:, :3] @ middle - planes[:, 3]
    errors = np.abs(depths - [2.5, 2.5, 2.0, 2.0, 1.4, 1.4])
    spreads = np.array(found["plane_sd_m"])
    assert np.all(errors < 5 * spreads)
    assert np.all(spreads < 1e-3)
    assert abs(found["speed_of_sound"] - 343.2) < 4 * found["speed_of_sound_sd"]


def test_long_pulses_rendered_by_moments_are_the_same_sound(box_set, heard):
    rng = np.random.default_rng(5)
    few = box_set.rows(np.arange(0, 120, 9))
    room = replace(heard.fitted.room, latency_s=-3 / few.sample_rate)
    long = PulseBank(rng.standard_normal((8, 100)), 30)
    parts = [PulseBank(long.taps[:, k : k + 50].copy(), 30 - k) for k in (0, 50)]
    ends = few.emitters, few.listeners, few.n_samples
    whole = sum(room.render(*ends, part) for part in parts)
    gap = np.abs(room.render(*ends, long) - whole)[:, :-40].max()
    assert gap < 1e-11 * np.abs(whole).max()
