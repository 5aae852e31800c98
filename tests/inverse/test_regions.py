"""Regions from who sees whom."""

import numpy as np
from numpy.testing import assert_allclose

from inverse.rows.regions import Regions, find_regions, sight_bits


def two_rooms(count, seed, wrong=0.03):
    rng = np.random.default_rng(seed)
    emitters = rng.uniform([0.3, 0.3, 1], [8.7, 3.7, 2], (6, 3))
    emitters[:, 0] = [1.0, 2.5, 4.0, 5.7, 7.0, 8.2]
    emitters = np.repeat(emitters, count, axis=0)
    listeners = rng.uniform([0.3, 0.3, 1], [8.7, 3.7, 2], (len(emitters), 3))
    seen = (emitters[:, 0] > 5) == (listeners[:, 0] > 5)
    flip = rng.random(len(seen)) < wrong
    return emitters, listeners, np.where(flip, ~seen, seen).astype(float)


def test_two_rooms_are_found_from_wrong_bits_and_single_looks():
    emitters, listeners, bits = two_rooms(30, 0)
    regions = find_regions(emitters, listeners, bits)
    assert regions.count == 2
    # A new place is told by its neighbours.
    places = np.random.default_rng(5).uniform([0.3, 0.3, 1], [8.7, 3.7, 2], (300, 3))
    told, right = regions.numbers(places), places[:, 0] > 5
    assert max((told == right).mean(), (told != right).mean()) > 0.95
    assert_allclose(regions(places).sum(axis=1), 1.0)


def test_a_room_that_sees_itself_is_one_region():
    emitters, listeners, bits = two_rooms(30, 1)
    assert find_regions(emitters, listeners, np.ones_like(bits)).count == 1
    nothing = np.full_like(bits, np.nan)
    assert find_regions(emitters, listeners, nothing).count == 1


def test_hidden_at_random_is_no_region():
    emitters, listeners, bits = two_rooms(30, 2)
    rng = np.random.default_rng(0)
    hidden = (rng.random(len(bits)) > 0.3).astype(float)
    assert find_regions(emitters, listeners, hidden).count == 1


def test_a_few_wrong_flags_do_not_move_the_border():
    rng = np.random.default_rng(4)
    places = rng.uniform([0.3, 0.3, 1], [8.7, 3.7, 2], (60, 3))
    flags = (places[:, 0] > 5).astype(int)
    flags[:3] = 1 - flags[:3]
    regions = Regions(places, np.eye(2)[flags])
    assert ((places[:, 0] > 5) == regions.numbers(places)).mean() >= 59 / 60


def test_direct_sounds_that_arrive_are_seen():
    rate, speed = 16000.0, 343.0
    distances = np.array([1.0, 2.0, 3.0, 4.0, 2.5, 1.5])
    responses = np.zeros((6, 800))
    for row, distance in enumerate(distances):
        responses[row, round(distance / speed * rate)] = 1 / distance
    responses[2] *= 0.1
    bits = sight_bits(responses, distances, rate, speed)
    assert_allclose(bits, [1, 1, 0, 1, 1, 1])
    silence = sight_bits(0 * responses, distances, rate, speed)
    assert np.isnan(silence).all()
