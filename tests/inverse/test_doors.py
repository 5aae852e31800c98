"""Rooms behind a door: sight, first arrivals, edges, openings and joined shapes."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from inverse.late.late_maps import LateMaps, fit_maps
from inverse.paths.oriented_box import OrientedBox
from inverse.rows.direct import read_direct
from inverse.rows.fitset import FitSet, place_numbers
from inverse.rows.onsets import read_onsets
from inverse.rows.partition import split_by_planes
from inverse.rows.regions import find_regions
from inverse.rows.sight import read_sight
from inverse.walls.joining import join_rooms
from inverse.walls.opening import Opening, Slab, find_opening, find_thickness
from inverse.walls.slabs import find_slab, half_slab, joined_shape, with_face
from rir import Poses

RATE, SPEED = 16000, 343.2
HOLE = np.array([1.5, 2.4, 0.0, 2.05])
ROOMS = np.array([[[0, 0, 0], [5, 4, 2.6]], [[5.2, 0, 0], [9.2, 4, 2.6]]])
FRAME = np.array([[-1.0, 0, 0], [0, 1, 0], [0, 0, 1]])


def slab(thick=0.2):
    limits = np.array([0.0, 4.0, 0.0, 2.6])
    return Slab(np.array([5.0, 0.0, 0.0]), FRAME, thick, limits)


def box_of(room):
    middle = room.mean(axis=0)
    return OrientedBox(
        np.eye(3), middle, room[0] - middle, room[1] - middle, np.full(6, 9.0)
    )


def drawn(rng, room, count, margin=0.4):
    return rng.uniform(ROOMS[room][0] + margin, ROOMS[room][1] - margin, (count, 3))


def across(count, seed, margin=0.4):
    rng = np.random.default_rng(seed)
    return drawn(rng, 0, count, margin), drawn(rng, 1, count, margin)


def rows_through_door(emitters=5, listeners=40, seed=0, cardioid=False):
    """Return rows of first arrivals alone: straight, or bent and ten times fainter."""
    rng = np.random.default_rng(seed)
    first, second, turns = [], [], []
    for k in range(emitters):
        room = k % 2
        place, half = drawn(rng, room, 1)[0], rng.uniform(0, np.pi)
        for n in range(listeners):
            first.append(place)
            second.append(drawn(rng, n % 2, 1)[0])
            turns.append([0, 0, np.sin(half), np.cos(half)])
    first, second, turns = map(np.array, (first, second, turns))
    far = first[:, 0] > 5.1, second[:, 0] > 5.1
    apart = far[0] != far[1]
    ways = np.linalg.norm(first - second, axis=1)
    hole = Opening(slab(), HOLE, np.ones(4, bool), 1.0)
    swap = far[0][apart, None]
    ends = first[apart], second[apart]
    ways[apart] = hole.ways(np.where(swap, *ends[::-1]), np.where(swap, *ends))
    seen = ways - np.linalg.norm(first - second, axis=1) < 1e-6
    level = np.where(seen, 1.0, 0.1) / ways
    if cardioid:
        yaw = 2 * np.arctan2(turns[:, 2], turns[:, 3])
        way = (second - first) / np.linalg.norm(second - first, axis=1)[:, None]
        level *= 0.5 + 0.5 * (way[:, 0] * np.cos(yaw) + way[:, 1] * np.sin(yaw))
    at = np.arange(700) - (ways / SPEED * RATE)[:, None]
    sound = level[:, None] * np.sinc(at) * np.exp(-0.5 * (at / 8) ** 2)
    sound += 1e-5 * rng.standard_normal(sound.shape)
    blocks = np.zeros(len(first), dtype=np.int64)
    places = Poses(first, turns), Poses.of(second)
    rows = FitSet(sound, *places, RATE, SPEED, place_numbers(first), blocks)
    return rows, seen, ways


@pytest.mark.parametrize("cardioid", [False, True])
def test_sight_and_rooms_are_read_from_responses(cardioid):
    rows, seen, _ = rows_through_door(cardioid=cardioid)
    sight = read_sight(rows, read_direct(rows))
    known = np.isfinite(sight.bits)
    assert known.mean() > 0.5
    assert (sight.bits[known] == seen[known]).mean() > 0.95
    regions = sight.regions(rows)
    right = regions.numbers(rows.listeners.positions) == (
        rows.listeners.positions[:, 0] > 5.1
    )
    assert regions.count == 2
    assert max(right.mean(), 1 - right.mean()) == 1.0


def test_silence_is_in_doubt():
    rows, _, _ = rows_through_door(2, 8)
    silent = replace(rows, responses=0 * rows.responses)
    assert np.isnan(read_sight(silent, read_direct(rows)).bits).all()


def test_first_arrivals_are_read_to_a_centimetre():
    rows, _, ways = rows_through_door()
    told = read_onsets(rows, read_direct(rows)).lengths
    known = np.isfinite(told)
    assert known.mean() > 0.9
    assert np.median(np.abs(told - ways)[known]) < 0.01


def test_the_wall_is_found_where_most_see_each_other():
    rng = np.random.default_rng(2)
    emitters = np.array([[4.0, 2, 1], [3, 2, 1.2], [6.5, 2, 1], [8, 2, 1.3]])
    emitters = emitters.repeat(40, axis=0)
    listeners = np.concatenate([drawn(rng, n % 2, 1) for n in range(160)])
    apart = (emitters[:, 0] > 5.1) != (listeners[:, 0] > 5.1)
    seen = np.where(apart, rng.random(160) < 0.5, rng.random(160) > 0.02)
    regions = find_regions(emitters, listeners, seen.astype(float))
    assert regions.count == 2
    told = regions.numbers(listeners) == (listeners[:, 0] > 5.1)
    assert max(told.mean(), 1 - told.mean()) > 0.97


def test_planes_do_not_split_a_room_that_sees_itself():
    rng = np.random.default_rng(3)
    places = rng.uniform(0, 5, (60, 3))
    pairs = rng.integers(0, 60, (2, 200))
    numbers = np.zeros(60, dtype=np.int64)
    _, score = split_by_planes(places, pairs, np.ones(200), numbers)
    assert score < 200 * np.log(0.97)


def test_ways_through_a_hole_are_the_shortest_of_a_fine_grid():
    first, second = across(3, 5)
    told = Opening(slab(), HOLE, np.ones(4, bool), 1.0).ways(first, second)
    y, z = np.meshgrid(np.linspace(1.5, 2.4, 31), np.linspace(0, 2.05, 31))
    near = np.stack([np.full(961, 5.0), y.ravel(), z.ravel()], axis=1)
    far = near + np.array([0.2, 0, 0])
    inner = np.linalg.norm(near[:, None] - far, axis=-1)
    for k in range(3):
        a = np.linalg.norm(near - first[k], axis=1)
        b = np.linalg.norm(far - second[k], axis=1)
        assert_allclose(told[k], (a[:, None] + inner + b).min(), atol=0.003)


def test_the_hole_and_what_was_not_told_of_it():
    first, second = across(120, 6, margin=0.1)
    truth = Opening(slab(), HOLE, np.ones(4, bool), 1.0)
    lengths = truth.ways(first, second)
    found = find_opening(slab(), first, second, lengths)
    assert found is not None
    assert found.known[[0, 1, 3]].all()
    assert_allclose(found.hole, HOLE, atol=0.02)
    # without the pairs whose way leads past the lintel it cannot be told
    open_above = replace(truth, hole=np.r_[HOLE[:3], 2.6])
    plain = np.abs(lengths - open_above.ways(first, second)) < 1e-4
    blind = find_opening(slab(), first[plain], second[plain], lengths[plain])
    assert blind is not None
    assert not blind.known[3]
    assert blind.hole[3] == 2.6


def test_no_hole_is_told_of_arrivals_at_random():
    first, second = across(80, 7)
    rng = np.random.default_rng(1)
    noise = np.linalg.norm(first - second, axis=1) + rng.uniform(0, 3, 80)
    assert find_opening(slab(), first, second, noise) is None


def test_a_wall_of_which_one_face_was_heard_is_as_thick_as_sound_says():
    first, second = across(150, 8)
    lengths = Opening(slab(), HOLE, np.ones(4, bool), 1.0).ways(first, second)
    deaf = box_of(ROOMS[1])
    deaf = replace(deaf, low=np.r_[-500.0, deaf.low[1:]])
    half = half_slab(box_of(ROOMS[0]), deaf, second)
    assert half is not None
    found, told = find_thickness(half, first, second, lengths)
    assert found is not None
    assert told
    assert_allclose(found.slab.thick, 0.2, atol=0.02)
    assert_allclose(with_face(deaf, found.slab).planes[0], [1, 0, 0, 5.2], atol=0.02)


def test_rooms_and_hole_make_one_closed_shape():
    boxes = [box_of(room) for room in ROOMS]
    wall = find_slab(*boxes)
    assert wall is not None
    assert_allclose(wall.thick, 0.2, atol=1e-9)
    span = (wall.frame[1] @ [0, 1, 0]) * HOLE[:2]
    hole = np.r_[np.sort(span), HOLE[2:]]
    opening = Opening(wall, hole, np.array([True, True, False, True]), 1.0)
    shape = joined_shape(boxes, [opening])
    assert shape is not None
    assert shape.mesh.watertight
    volume = 5 * 4 * 2.6 + 4 * 4 * 2.6 + 0.2 * 0.9 * 2.05
    assert_allclose(shape.mesh.volume, volume, rtol=1e-6)
    rng = np.random.default_rng(9)
    ends = np.concatenate([drawn(rng, k, 50, 0.05) for k in (0, 1)])
    assert not shape.mesh.outside(ends).any()


def test_a_fade_in_follows_from_the_balance_of_modes():
    # two rooms: energies .02 and 2e-4, the fast mode ten times the slow in the second
    flags, level = np.eye(2), 0.5 * np.log([0.02, 2e-4])
    maps = LateMaps(np.array([15.0, 65.0]), level, np.array([[0.02, 10.0]]))
    rows = flags[[0, 0, 1, 1]], flags[[0, 1, 0, 1]]
    times = 0.07 + 0.02 * np.arange(30)
    log = maps.log_energies(*rows, times)
    told = fit_maps(log, times, *rows, maps.rates, flags=2)
    assert told.shares[0, 0] * told.shares[0, 1] < 0


def test_one_room_is_left_as_it_is(box_set):
    assert join_rooms(box_set, None, ["as it was"], 0.05) == (None, ["as it was"])
