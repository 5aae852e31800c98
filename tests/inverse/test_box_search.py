"""Whole boxes told apart by their images: hidden walls and faint direct sounds."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from inverse.paths.bank import ideal_bank
from inverse.paths.oriented_box import OrientedBox
from inverse.paths.room import OMNI, BoxRoom
from inverse.rows.direct import read_direct
from inverse.rows.fitset import FitSet
from inverse.walls.box_search import search_box
from inverse.walls.low_sound import LowSound
from rir import Poses

SIZE = np.array([5.0, 4.0, 2.8])
CARDIOID = np.sqrt(np.pi) * np.array([1.0, 0.0, 0.0, 1 / np.sqrt(3)])
RATE, SPEED = 16000.0, 343.2


def box_of(low=(0.0, 0.0, 0.0), high=tuple(SIZE)):
    return OrientedBox(
        np.eye(3), np.zeros(3), np.array(low), np.array(high), np.ones(6)
    )


def rows_of(place=(4.3, 1.6, 1.2), yaw=np.pi, walls=(0.85,) * 6, listeners=24):
    """Return rows of one cardioid; by default its back is to the wall x = 5."""
    rng = np.random.default_rng(2)
    first = Poses(
        np.tile(place, (listeners, 1)),
        np.tile([0, 0, np.sin(yaw / 2), np.cos(yaw / 2)], (listeners, 1)),
    )
    second = Poses.of(rng.uniform(0.4, SIZE - 0.4, (listeners, 3)))
    room = BoxRoom(
        box_of(), SPEED, 0.0, np.array(walls), CARDIOID, OMNI, ideal_bank(36), RATE
    )
    sound = room.render(first, second, 900)
    zero = np.zeros(listeners, dtype=np.int64)
    return FitSet(sound, first, second, RATE, SPEED, zero, zero)


@pytest.fixture(scope="module")
def rows():
    return rows_of()


def test_low_sound_is_told_by_the_room_it_is_from(rows):
    low = LowSound.of(rows, read_direct(rows))
    assert low.rows.n_samples < rows.n_samples / 8
    right = low.tried(low.room(box_of()), 4)
    assert right.left < 1e-3
    assert_allclose(right.room.walls, 0.85, atol=0.03)
    assert low.tried(low.room(box_of(high=(6.4, 4.0, 2.8))), 4).left > 0.05


def test_the_wall_behind_the_loudspeaker_is_told_from_an_echo_of_two(rows):
    # what is heard first beyond it is the echo by way of the opposite wall
    found = search_box(rows, read_direct(rows), [box_of(high=(9.3, 4.0, 2.8))])
    assert found.unexplained < 0.01
    assert_allclose(found.box.high, SIZE, atol=2e-3)
    assert_allclose(found.box.low, 0.0, atol=2e-3)


def test_two_walls_may_be_hidden_at_once():
    rows = rows_of(place=(4.3, 3.4, 1.2), yaw=-0.75 * np.pi, listeners=40)
    found = search_box(rows, read_direct(rows), [box_of(high=(9.3, 7.4, 2.8))])
    assert_allclose(found.box.high, SIZE, atol=2e-3)


def test_a_wall_that_reflects_nothing_is_left_out():
    rows = rows_of(walls=(0.85, 0.0, 0.85, 0.85, 0.85, 0.85), yaw=0.0)
    found = search_box(rows, read_direct(rows), [box_of()])
    assert found.box.found.tolist() == [True, False, True, True, True, True]


def test_a_faint_direct_sound_is_found_before_a_louder_wall():
    rng = np.random.default_rng(3)
    second = rng.uniform(0.5, 4.0, (60, 3))
    first = Poses.of(np.zeros((60, 3)))
    reach = np.linalg.norm(second, axis=1)
    times = np.arange(600) / RATE
    late = reach / SPEED + 0.004 + 6e-5 * rng.standard_normal(60)
    level = 1 / reach[:, None]
    sound = 0.15 * level * np.sinc(RATE * (times - (reach / SPEED)[:, None]))
    sound += (
        level * np.sinc(RATE * (times - late[:, None])) * rng.uniform(0, 0.7, (60, 1))
    )
    zero = np.zeros(60, dtype=np.int64)
    rows = FitSet(sound, first, Poses.of(second), RATE, SPEED, zero, zero)
    assert read_direct(rows).latency_s == 0.0
