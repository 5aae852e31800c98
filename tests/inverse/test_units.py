"""Direct sounds tell which units and which sample rate are meant."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from inverse.rows.units import checked_units, travelled_speed
from rir import Poses


def scaled(rows, factor):
    ends = [Poses(factor * one.positions, one.orientations) for one in rows_ends(rows)]
    return replace(rows, emitters=ends[0], listeners=ends[1])


def rows_ends(rows):
    return rows.emitters, rows.listeners


def test_right_units_are_left_alone(box_set):
    same, doubts = checked_units(box_set)
    assert same is box_set
    assert not doubts


@pytest.mark.parametrize(
    ("factor", "unit"),
    [(1000.0, "millimetres"), (100.0, "centimetres"), (3.2808, "feet")],
)
def test_other_units_are_named(box_set, factor, unit):
    _, doubts = checked_units(scaled(box_set, factor))
    assert len(doubts) == 1
    assert unit in doubts[0]


def test_another_sample_rate_is_named(box_set):
    _, doubts = checked_units(replace(box_set, sample_rate=44100.0))
    rate = float(doubts[0].split("sample rate were ")[1].split()[0])
    assert_allclose(rate, 16000, rtol=0.01)


def test_hot_air_is_taken_over(box_set):
    warm, doubts = checked_units(replace(box_set, speed_of_sound=330.0))
    assert_allclose(warm.speed_of_sound, 343.2, rtol=0.005)
    assert not doubts


def test_noise_and_few_rows_tell_no_speed(box_set):
    rng = np.random.default_rng(0)
    noise = replace(box_set, responses=rng.standard_normal(box_set.responses.shape))
    assert travelled_speed(noise) is None
    assert travelled_speed(box_set.rows(np.arange(6))) is None


def test_sound_that_bends_round_corners_is_not_taken_for_wrong_units(box_set):
    rng = np.random.default_rng(4)
    hidden = rng.permutation(len(box_set))[:66]
    longer = rng.uniform(1.05, 1.45, len(box_set)) * box_set.distances
    detour = longer * box_set.sample_rate / box_set.speed_of_sound
    responses = np.array(box_set.responses)
    for row in hidden:
        responses[row] = 0.0
        responses[row, min(round(detour[row]), responses.shape[1] - 1)] = 1.0
    _, doubts = checked_units(replace(box_set, responses=responses))
    assert not doubts
