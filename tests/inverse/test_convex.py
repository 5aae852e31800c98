"""Convex rooms whose walls are not square, heard blind."""

# pyright: reportOptionalMemberAccess=false
import numpy as np
import pytest
from numpy.testing import assert_allclose

from inverse.find import room_in_rows
from inverse.paths.bank import ideal_bank
from inverse.paths.mesh_room import MeshRoom
from inverse.paths.polyhedron import Polyhedron
from inverse.paths.room import OMNI
from inverse.rows.direct import read_direct
from inverse.rows.fitset import FitSet, place_numbers
from inverse.walls.convex import convex_room, try_convex
from inverse.walls.scan import FoundPlane, scan_planes, scan_signals
from path_rooms import level_errors
from rir import Poses
from rooms.mesh import MeshGeometry

RATE, SPEED, HEIGHT = 16000, 343.2, 2.8
OUTLINE = [(0, 0), (5.5, 0), (4.8, 4.2), (0.5, 3.6)]


def trapezoid_rows(emitters, listeners, seed):
    rng = np.random.default_rng(seed)
    shape = Polyhedron.of_mesh(MeshGeometry.extruded(OUTLINE, HEIGHT))
    low, high = [0.9, 0.4, 0.4], [4.4, 3.2, HEIGHT - 0.4]
    first = rng.uniform(low, high, (emitters, 3)).repeat(listeners, axis=0)
    second = rng.uniform(low, high, (len(first), 3))
    walls = np.array([0.9, 0.85, 0.8, 0.85, 0.9, 0.8])
    room = MeshRoom(shape, SPEED, 0.0, walls, OMNI, OMNI, ideal_bank(36), RATE, 4, 25.0)
    ends = Poses.of(first), Poses.of(second)
    blocks = np.zeros(len(first), dtype=np.int64)
    sound = room.render(*ends, 800)
    return FitSet(sound, *ends, RATE, SPEED, place_numbers(first), blocks)


@pytest.fixture(scope="module")
def oblique_set():
    return trapezoid_rows(4, 30, 0)


def test_a_trapezoid_is_heard_blind_to_its_waveforms(oblique_set):
    acoustics = room_in_rows(oblique_set)
    report, unseen = acoustics.report(), trapezoid_rows(2, 8, 5)
    told = acoustics.predict(unseen.emitters, unseen.listeners, unseen.n_samples)
    assert report["walls"] == 6
    assert np.median(level_errors(unseen.responses, told)) < -30
    shape = Polyhedron.of_mesh(MeshGeometry.extruded(OUTLINE, HEIGHT))
    for plane in np.array(report["planes"]):
        gaps = np.abs(shape.planes - plane).max(axis=1)
        assert gaps.min() < 1e-3
    volume = abs(HEIGHT * _area(OUTLINE))
    assert_allclose(report["volume_m3"], volume, rtol=1e-3)
    assert not acoustics.alarms


def test_a_box_is_left_to_the_box(box_set):
    direct = read_direct(box_set)
    found = scan_planes(scan_signals(box_set, direct))
    assert try_convex(box_set, direct, found, 30.0) is None


def test_phantoms_behind_walls_and_open_rooms_are_told_apart(box_set):
    rows = [(axis, sign) for axis in range(3) for sign in (1, -1)]
    walls = [_plane(axis, sign, 0.0) for axis, sign in rows]
    phantoms = [_plane(axis, sign, 3.0) for axis, sign in rows]
    shape = convex_room(box_set, walls + phantoms)
    assert_allclose(np.sort(shape.areas), [11.2, 11.2, 14.0, 14.0, 20.0, 20.0])
    assert convex_room(box_set, walls[1:]) is None


def _plane(axis, sign, behind):
    normal = sign * np.eye(3)[axis]
    offset = 0.0 if sign > 0 else -(5.0, 4.0, 2.8)[axis]
    return FoundPlane(normal, offset - behind, 10.0, 0.7, 1.0)


def _area(outline):
    x, y = np.array(outline, dtype=float).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
