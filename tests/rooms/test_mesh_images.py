import numpy as np
import pytest

from exhaustive_paths import (
    list_exhaustively,
    random_places,
    random_room,
)
from rir.errors import SceneError
from rooms.mesh import MeshGeometry, find_paths

FLOOR = [(0, 0), (6, 0), (6, 2.5), (3, 2.5), (3, 5), (0, 5)]
EMITTER = [1.7, 3.1, 1.4]


def split_box():
    """Return a 6 x 5 x 3 m box whose walls are cut up, with T-junctions."""
    box = MeshGeometry.box((6, 5, 3))
    corners = box.corners + box.origin
    pieces = []
    for k, (a, b, c) in enumerate(corners):
        if k % 3 == 0:
            m = (a + b) / 2 * 0.4 + a * 0.6
            pieces += [(a, m, c), (m, b, c)]
        else:
            m = a + 0.3 * (b - a) + 0.4 * (c - a)
            pieces += [(a, b, m), (b, c, m), (c, a, m)]
    vertices = np.array(pieces).reshape(-1, 3)
    return MeshGeometry.from_arrays(vertices, np.arange(len(vertices)).reshape(-1, 3))


@pytest.mark.parametrize("order", [1, 3, 5, 10])
def test_box_has_every_image(order):
    paths = find_paths(
        MeshGeometry.box((6, 5, 3)), EMITTER, [[4, 1, 2], [2, 2, 2.2]], max_order=order
    )
    wanted = (2 * order + 1) * (2 * order**2 + 2 * order + 3) // 3
    assert np.bincount(paths.listener).tolist() == [wanted, wanted]


def test_box_paths_are_those_of_the_lattice():
    order, listener = 4, np.array([4.0, 1.0, 2.0])
    paths = find_paths(
        MeshGeometry.box((6, 5, 3)), EMITTER, [listener], max_order=order
    )
    index = np.arange(-order, order + 1)
    axes = [
        np.where(index % 2 == 0, index * size + e, (index + 1) * size - e) - m
        for size, e, m in zip((6, 5, 3), EMITTER, listener, strict=True)
    ]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    count = sum(np.abs(g) for g in np.meshgrid(index, index, index, indexing="ij"))
    lengths = np.sort(np.linalg.norm(grid[count <= order], axis=-1))
    np.testing.assert_allclose(paths.length, lengths, rtol=1e-12)


def test_triangulation_does_not_matter():
    options = {"max_order": 4, "max_length": 40.0}
    plain = find_paths(MeshGeometry.box((6, 5, 3)), EMITTER, [[4, 1, 2]], **options)
    split = find_paths(split_box(), EMITTER, [[4, 1, 2]], **options)
    np.testing.assert_allclose(split.length, plain.length, rtol=1e-9)


def test_number_of_listeners_does_not_matter():
    room = MeshGeometry.extruded(FLOOR, 3)
    places = random_places(room, 20, np.random.default_rng(1))
    together = find_paths(room, EMITTER, places, max_order=4)
    for k in range(0, 20, 5):
        alone = find_paths(room, EMITTER, places[k], max_order=4)
        np.testing.assert_array_equal(
            alone.length, together.length[together.listener == k]
        )


def test_exchanging_the_ends_changes_no_bit():
    room = MeshGeometry.extruded(FLOOR, 3)
    reflection = np.random.default_rng(2).uniform(0.5, 1, (room.surfaces, 3))
    places = random_places(room, 15, np.random.default_rng(1))
    there = find_paths(room, EMITTER, places, max_order=5)
    gains = there.gains(reflection)
    for k, place in enumerate(places):
        back = find_paths(room, place, [EMITTER], max_order=5)
        rows = there.listener == k
        np.testing.assert_array_equal(back.length, there.length[rows])
        np.testing.assert_array_equal(back.departure, there.arrival[rows])
        np.testing.assert_array_equal(back.arrival, there.departure[rows])
        np.testing.assert_array_equal(back.gains(reflection), gains[rows])


def test_paths_equal_the_exhaustive_search_in_random_rooms():
    rng = np.random.default_rng(5)
    for _ in range(3):
        room = random_room(rng)
        places = random_places(room, 9, rng)
        wanted = list_exhaustively(room, places[0], places[1:], 3)
        found = find_paths(room, places[0], places[1:], max_order=3, direct=False)
        np.testing.assert_array_equal(found.listener, wanted[:, 0])
        np.testing.assert_allclose(found.length, wanted[:, 1], rtol=0, atol=1e-9)


def test_many_blockers_give_the_same_paths_as_few():
    box, table = MeshGeometry.box((6, 5, 3)), MeshGeometry.box((1, 1, 1))
    low = box.vertices + box.origin
    one = table.vertices + table.origin + [2.5, 2, 1]
    faces = np.concatenate([box.faces, table.faces + len(low)])
    room = MeshGeometry.from_arrays(np.concatenate([low, one]), faces)
    vertices = room.corners.reshape(-1, 3)
    a, b, c = np.moveaxis(room.corners, 1, 0)
    m = (a + b + c) / 3
    fine = np.concatenate([np.stack(t, 1) for t in ((a, b, m), (b, c, m), (c, a, m))])
    vertices = fine.reshape(-1, 3) + room.origin
    cut = MeshGeometry.from_arrays(vertices, np.arange(len(vertices)).reshape(-1, 3))
    assert len(cut.tables.blockers) > 12 >= len(room.tables.blockers)
    places = [[5, 4, 2], [3, 0.5, 0.5]]
    few = find_paths(room, [1, 1, 1.2], places, max_order=3)
    many = find_paths(cut, [1, 1, 1.2], places, max_order=3)
    np.testing.assert_allclose(many.length, few.length, rtol=1e-9)


def test_gains_are_reflections_over_length():
    room = MeshGeometry.box((6, 5, 3))
    paths = find_paths(room, EMITTER, [[4, 1, 2]], max_order=2)
    gains = paths.gains(np.full((6, 1), 0.8))
    np.testing.assert_allclose(gains[:, 0], 0.8**paths.order / paths.length)


def test_a_screen_reflects_on_both_sides_and_hides(screened_box):
    room = screened_box(5)
    ways = find_paths(room, [1, 2, 1], [[2, 2, 1], [5.2, 2, 1]], max_order=1)
    assert np.bincount(ways.listener, minlength=2).tolist() == [7, 0]
    ways = find_paths(room, [5, 2, 1], [[4, 2, 1]], max_order=1)
    assert len(ways) == 7


@pytest.mark.parametrize("scale", [0.01, 1.0, 100.0])
@pytest.mark.parametrize("shift", [0.0, 10_000.0])
def test_size_and_place_of_a_room_do_not_matter(scale, shift):
    floor = np.array(FLOOR) * scale / 6 + shift
    room = MeshGeometry.extruded(floor, scale / 2)
    base = np.array([shift, shift, 0])
    ways = find_paths(
        room,
        base + np.array([0.3, 0.5, 0.2]) * scale,
        [base + np.array([0.8, 0.1, 0.3]) * scale],
        max_order=3,
    )
    plain = MeshGeometry.extruded(np.array(FLOOR) / 6, 0.5)
    wanted = find_paths(plain, [0.3, 0.5, 0.2], [[0.8, 0.1, 0.3]], max_order=3)
    np.testing.assert_allclose(
        ways.length / scale, wanted.length, rtol=1e-9 * (1 + shift / scale)
    )


def test_emitter_at_the_listener_and_on_a_wall():
    room = MeshGeometry.box((6, 5, 3))
    same = find_paths(room, EMITTER, [EMITTER], max_order=2)
    assert len(same) == 25
    assert same.length[0] == 0
    assert np.all(np.isfinite(same.gains(np.ones((6, 1)))))
    wall = find_paths(room, [0, 2, 1], [[4, 2, 1]], max_order=1)
    np.testing.assert_allclose(wall.length[:2], 4, atol=1e-6)
    assert len(wall) == 7


def test_no_way_at_all_is_an_empty_answer():
    rooms = [MeshGeometry.box((2, 2, 2)), MeshGeometry.box((2, 2, 2))]
    vertices = np.concatenate(
        [room.vertices + room.origin + [5.0 * k, 0, 0] for k, room in enumerate(rooms)]
    )
    faces = np.concatenate([room.faces + 8 * k for k, room in enumerate(rooms)])
    both = MeshGeometry.from_arrays(vertices, faces)
    ways = find_paths(both, [1, 1, 1], [[6, 1, 1]], max_order=3)
    assert len(ways) == 0
    assert ways.gains(np.ones((1, 4))).shape == (0, 4)


def test_limits_are_said():
    room = MeshGeometry.box((6, 5, 3))
    assert not find_paths(room, EMITTER, [EMITTER], max_order=5, max_nodes=10).complete
    with pytest.raises(SceneError, match="order 0…100"):
        find_paths(room, EMITTER, [EMITTER], max_order=-1)
    with pytest.raises(SceneError, match="not finite"):
        find_paths(room, [np.nan, 1, 1], [EMITTER], max_order=1)
