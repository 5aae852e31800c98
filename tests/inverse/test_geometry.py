# pyright: reportOptionalMemberAccess=false
import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from inverse.acoustics import Acoustics
from inverse.paths.bank import ideal_bank
from inverse.paths.bent import bends, bent_sound
from inverse.paths.coloring import Coloring
from inverse.paths.mesh_room import MeshRoom
from inverse.paths.oriented_box import OrientedBox
from inverse.paths.path_list import list_paths
from inverse.paths.polyhedral import FittedMesh, fit_drawn, fit_polyhedron
from inverse.paths.polyhedron import Polyhedron
from inverse.paths.room import OMNI, BoxRoom
from inverse.paths.shoebox import fit_shoebox
from inverse.plan.ground_plan import box_shape, cut_at, plan_of
from inverse.plan.plan_plot import draw_plan
from inverse.rows.direct import read_direct
from inverse.rows.fitset import FitSet, place_numbers
from inverse.rows.pose_spread import pose_alarms
from inverse.walls.cells import cut_cells, enclosed, label_cells, shape_of
from inverse.walls.inner_walls import find_inner_walls
from inverse.walls.outline import find_clues, find_outline, other_outlines
from path_rooms import level_errors
from rir import Poses
from rooms.mesh import MeshGeometry

RATE, SPEED = 16000, 343.2
OUTLINE = [(0, 0), (6, 0), (6, 2.2), (3.4, 2.2), (3.4, 5), (0, 5)]
L_PLANES = np.array(
    [
        [1, 0, 0, 0],
        [-1, 0, 0, -6],
        [0, 1, 0, 0],
        [0, -1, 0, -5],
        [0, 0, 1, 0],
        [0, 0, -1, -3],
        [-1, 0, 0, -3.4],
        [0, -1, 0, -2.2],
    ],
    dtype=float,
)


def room_of(shape, order=5, factor=0.9):
    walls = np.full(len(shape.planes), factor)
    return MeshRoom(
        shape, SPEED, 0.0, walls, OMNI, OMNI, ideal_bank(36), RATE, order, 25.0
    )


def places_in_l(rng, count):
    found = []
    while len(found) < count:
        place = rng.uniform([0.4] * 3, [5.6, 4.6, 2.6])
        if place[0] < 3.0 or place[1] < 1.8:
            found.append(place)
    return np.array(found)


def l_rows(emitters=5, listeners=60, seed=3):
    rng = np.random.default_rng(seed)
    first = places_in_l(rng, emitters).repeat(listeners, axis=0)
    second = places_in_l(rng, len(first))
    room = room_of(Polyhedron.of_mesh(MeshGeometry.extruded(OUTLINE, 3.0)))
    ends = Poses.of(first), Poses.of(second)
    sound = room.render(*ends, 900)
    blocks = np.zeros(len(first), dtype=np.int64)
    return FitSet(sound, *ends, RATE, SPEED, place_numbers(first), blocks)


@pytest.fixture(scope="module")
def l_set():
    return l_rows()


def as_found(planes):
    """Return how far the nearest true plane is from each, metres."""
    return np.abs(planes[:, None] - L_PLANES).max(axis=2).min(axis=1)


def l_cells(planes):
    cells = cut_cells(planes, np.full(3, -20.0), np.full(3, 20.0))
    poses = np.array([[1, 0.5, 1], [1, 1.5, 1], [1, 4, 1], [5, 0.5, 1], [5, 1.5, 1]])
    held = enclosed(cells, planes, poses)
    air = np.zeros(len(cells), dtype=bool)
    air[held] = True
    support = np.zeros((len(cells), len(planes)))
    support[:, :8] = 0.3
    return cells, label_cells(cells, air, support)


def test_cells_fill_space_and_the_air_is_an_l():
    cells, inside = l_cells(L_PLANES)
    assert_allclose(sum(cell.volume for cell in cells), 40.0**3)
    shape = shape_of(cells, inside, L_PLANES)
    assert shape.mesh.watertight
    assert_allclose(shape.mesh.volume, 3 * (30 - 2.6 * 2.8))
    assert_allclose(as_found(shape.planes), 0, atol=1e-12)


def test_a_plane_through_air_is_no_wall():
    extra = np.vstack([L_PLANES, [0, 1, 0, 1.0]])
    cells, inside = l_cells(extra)
    shape = shape_of(cells, inside, extra)
    assert len(shape.planes) == 8
    assert_allclose(shape.mesh.volume, 3 * (30 - 2.6 * 2.8))


def test_corners_follow_their_planes():
    shape = Polyhedron.of_mesh(MeshGeometry.extruded(OUTLINE, 3.0))
    planes = shape.planes.copy()
    planes[:, 3] -= 0.1
    moved = shape.moved(planes)
    # all walls 10 cm outwards; only outer ones make the L longer
    assert_allclose(moved.mesh.volume, 3.2 * (6.2 * 5.2 - 2.6 * 2.8))


def test_mirror_paths_of_a_box_are_those_of_the_lattice():
    size = np.array([5.0, 4.0, 2.8])
    box = OrientedBox(np.eye(3), np.zeros(3), np.zeros(3), size, np.ones(6))
    shape = box_shape(box)
    assert_allclose(shape.planes, box.planes)
    factors = np.array([0.9, 0.8, 0.7, 0.6, 0.5, 0.95])
    lattice = BoxRoom(
        box, SPEED, 0.0, factors, OMNI, OMNI, ideal_bank(36), RATE, 4, 12.0
    )
    mesh = replace(room_of(shape, 4), walls=factors, reach_m=12.0)
    rng = np.random.default_rng(0)
    one, other = (Poses.of(rng.uniform(0.5, size - 0.5, (6, 3))) for _ in range(2))
    told = mesh.render(one, other, 600)
    assert_allclose(told, lattice.render(one, other, 600), atol=1e-9)


def test_exchanged_ends_hear_the_same(l_set):
    rng = np.random.default_rng(3)
    room = room_of(Polyhedron.of_mesh(MeshGeometry.extruded(OUTLINE, 3.0)), 4)
    one, other = rng.standard_normal((2, 9))
    there = replace(room, emitting=one, listening=other)
    back = replace(room, emitting=other, listening=one)
    first, second = l_set.emitters[:8], l_set.listeners[:8]
    for answer in (MeshRoom.render, bent_sound):
        told = answer(there, first, second, 700)
        turned = answer(back, second, first, 700)
        assert_allclose(turned, told, atol=1e-12 * np.abs(told).max())


def test_hidden_ends_have_no_direct_path():
    shape = Polyhedron.of_mesh(MeshGeometry.extruded(OUTLINE, 3.0))
    ends = np.array([[1.0, 4.5, 1.5]]), np.array([[5.5, 1.0, 1.5]])
    paths = list_paths(shape, *ends, 3, 20.0)
    assert 0 not in paths.order
    assert len(paths.order) > 0
    back = list_paths(shape, ends[1], ends[0], 3, 20.0)
    assert sorted(map(tuple, paths.walls)) == sorted(
        tuple(row[row >= 0][::-1]) + tuple(row[row < 0]) for row in back.walls
    )


def test_sound_bends_to_hidden_ends():
    shape = Polyhedron.of_mesh(MeshGeometry.extruded(OUTLINE, 3.0))
    room = room_of(shape)
    assert bends(room)
    one, other = Poses.of([[1.0, 4.5, 1.5]]), Poses.of([[5.5, 1.0, 1.5]])
    told = bent_sound(room, one, other, 700)[0]
    edge = np.array([3.4, 2.2, 1.5])
    way = np.linalg.norm(edge - [1, 4.5, 1.5]) + np.linalg.norm(edge - [5.5, 1, 1.5])
    first = int(np.flatnonzero(np.abs(told) > 0.3 * np.abs(told).max())[0])
    assert_allclose(first, way / SPEED * RATE, atol=1.5)
    # the corner's shadow is deeper the higher the sound
    spectrum = np.abs(np.fft.rfft(told[: first + 16], 1024))
    assert 1 / way > spectrum[32] > spectrum[256] > 0


def test_a_box_bends_nothing():
    assert not bends(room_of(Polyhedron.of_mesh(MeshGeometry.box((5, 4, 3)))))


def test_planes_drawn_wrong_are_put_right(l_set):
    shape = Polyhedron.of_mesh(MeshGeometry.extruded(OUTLINE, 3.0))
    planes = shape.planes.copy()
    planes[:, 3] += np.random.default_rng(1).uniform(-0.04, 0.04, len(planes))
    direct = read_direct(l_set)
    fitted = fit_polyhedron(l_set, direct, shape.moved(planes), 20.0)
    assert_allclose(as_found(fitted.room.shape.planes), 0, atol=1e-3)
    assert_allclose(fitted.room.walls, 0.9, atol=0.02)
    test = l_rows(2, 5, 8)
    told = fitted.predict(test.emitters, test.listeners, test.n_samples)
    assert np.median(level_errors(test.responses, told)) < -25


def test_a_room_drawn_elsewhere_is_refused(l_set):
    away = MeshGeometry.extruded(np.array(OUTLINE) + 30.0, 3.0)
    fitted, alarms = fit_drawn(l_set, read_direct(l_set), Polyhedron.of_mesh(away), 0.1)
    assert fitted is None
    assert "outside the room as drawn" in alarms[0]


@pytest.fixture(scope="module")
def boxed(l_set):
    box = OrientedBox(
        np.eye(3), np.zeros(3), np.zeros(3), np.array([6.0, 5.0, 3.0]), np.ones(6)
    )
    direct = read_direct(l_set)
    return direct, fit_shoebox(l_set, direct, box, 20.0)


def test_walls_between_poses_are_found(l_set, boxed):
    opened = find_inner_walls(l_set, boxed[0], boxed[1], 0.06)
    assert opened.alarms == []
    planes = opened.fitted.room.shape.planes
    assert len(planes) == 8
    assert_allclose(as_found(planes), 0, atol=3e-3)
    assert_allclose(opened.fitted.report()["volume_m3"], 68.16, rtol=0.02)


def test_an_arm_that_holds_one_emitter_is_closed_on_trial(boxed):
    places = np.array([[1.0, 3.0, 1.2], [2.3, 4.4, 2.4], [4.6, 1.1, 2.3]])
    first = places.repeat(60, axis=0)
    second = places_in_l(np.random.default_rng(5), len(first))
    room = room_of(Polyhedron.of_mesh(MeshGeometry.extruded(OUTLINE, 3.0)))
    ends = Poses.of(first), Poses.of(second)
    sound = room.render(*ends, 900)
    still = np.zeros(len(first), dtype=np.int64)
    rows = FitSet(sound, *ends, RATE, SPEED, place_numbers(first), still)
    clues = find_clues(rows, boxed[0], boxed[1])
    outline = find_outline(clues)
    assert outline is None or not outline.closed
    other = next(other_outlines(clues))
    assert other.closed
    assert_allclose(as_found(other.shape.planes), 0, atol=0.01)
    assert len(other.shape.planes) == 8


def test_noise_holds_no_walls_between_poses(l_set, boxed):
    rng = np.random.default_rng(5)
    noise = replace(l_set, responses=rng.standard_normal(l_set.responses.shape))
    assert find_inner_walls(noise, boxed[0], boxed[1], 0.06).fitted is None


def test_a_plan_shows_what_was_heard(l_set, boxed, tmp_path):
    fitted = find_inner_walls(l_set, boxed[0], boxed[1], 0.06).fitted
    known = MeshGeometry.extruded(OUTLINE, 3.0)
    ends = l_set.emitters.positions, l_set.listeners.positions
    plan = plan_of(
        Acoustics(fitted, None, None, 0.1, ["a wall is missing"]),
        *ends,
        known.corners + known.origin,
        "SIMULATED",
    )
    assert sorted(wall.level for wall in plan.walls)[-2:] == ["ceiling", "floor"]
    length = np.linalg.norm(np.diff(plan.known, axis=1), axis=2).sum()
    assert_allclose(length, 22.0, atol=1e-3)
    drawn = [wall for wall in plan.walls if not wall.level]
    pieces = np.concatenate([wall.pieces for wall in drawn])
    assert_allclose(
        np.linalg.norm(np.diff(pieces, axis=1), axis=2).sum(), 22, atol=0.02
    )
    heard = np.concatenate([wall.heard for wall in drawn])
    assert 0.5 < heard.mean() < 1.0
    plan.save(tmp_path / "plan.json")
    told = json.loads((tmp_path / "plan.json").read_text())
    assert told["mark"] == "SIMULATED"
    assert len(told["walls"]) == 8
    draw_plan(tmp_path / "plan.png", plan)
    assert (tmp_path / "plan.png").stat().st_size > 10_000


def test_a_cut_follows_the_outline():
    square = MeshGeometry.box((2, 3, 4))
    cuts = cut_at(square.corners + square.origin, square.face_surface, 1.0)
    length = sum(float(np.linalg.norm(one - other)) for _, (one, other) in cuts)
    assert_allclose(length, 10.0)


def test_poses_on_a_line_and_in_a_plane_are_told(l_set):
    assert pose_alarms(l_set) == []
    flat = l_set.listeners.positions * np.array([1, 1, 0])
    emitters = l_set.emitters.positions * np.array([1, 1, 0])
    level = replace(l_set, emitters=Poses.of(emitters), listeners=Poses.of(flat))
    assert "in one plane" in pose_alarms(level)[0]
    line = replace(
        l_set,
        emitters=Poses.of(emitters * np.array([1, 0, 0])),
        listeners=Poses.of(flat * np.array([1, 0, 0])),
    )
    assert "on one line" in pose_alarms(line)[0]


def test_a_stored_room_answers_the_same(l_set):
    shape = Polyhedron.of_mesh(MeshGeometry.extruded(OUTLINE, 3.0))
    room = room_of(shape, 3)
    fitted = FittedMesh(room, Coloring.none(RATE), np.full(8, 1e-3), bending=True)
    stored = {name: np.asarray(value) for name, value in fitted.as_arrays().items()}
    again = FittedMesh.from_arrays(stored)
    ends = l_set.emitters[:3], l_set.listeners[:3]
    told = fitted.predict(ends[0], ends[1], 500)
    assert_allclose(again.predict(ends[0], ends[1], 500), told, rtol=0, atol=0)
    assert again.bending
