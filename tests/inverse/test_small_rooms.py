"""Small rooms are scanned as if they were larger."""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose

from inverse.paths.oriented_box import FAR_M
from inverse.rows.direct import read_direct
from inverse.walls.small_rooms import magnification, magnified, scan_room
from rir import Poses


def shrunk(rows, times):
    ends = [
        Poses(one.positions / times, one.orientations)
        for one in (rows.emitters, rows.listeners)
    ]
    return replace(
        rows, emitters=ends[0], listeners=ends[1], sample_rate=rows.sample_rate * times
    )


def test_ordinary_rooms_are_scanned_as_they_are(box_set):
    assert magnification(box_set) == 1
    direct = read_direct(box_set)
    assert scan_room(box_set, direct, 120).direct is not None
    assert_allclose(scan_room(box_set, direct, 120).direct.pulse, direct.pulse)


def test_a_magnified_room_has_the_same_samples(box_set):
    small = shrunk(box_set, 2.5)
    again = magnified(small, 2.5)
    assert_allclose(again.emitters.positions, box_set.emitters.positions)
    assert again.sample_rate == box_set.sample_rate


def test_the_walls_of_a_car_are_found_where_they_are(box_set):
    small = shrunk(box_set, 2.5)
    assert magnification(small) > 2
    found = scan_room(small, read_direct(small), 120)
    box = found.boxes[0]
    assert box.found.all()
    assert_allclose(box.planes[:, 3], [0, -2, 0, -1.6, 0, -1.12], atol=0.01)
    assert_allclose(found.direct.latency_s, 0, atol=1 / small.sample_rate)


def test_walls_not_heard_stay_unheard(box_set):
    from inverse.walls.small_rooms import _shrunk

    box = scan_room(box_set, read_direct(box_set), 120).boxes[0]
    high = box.high.copy()
    high[0] = FAR_M
    less = _shrunk(replace(box, high=high), 3.0)
    assert np.count_nonzero(less.found) == 5
    assert less.high[0] == FAR_M
