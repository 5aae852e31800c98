import numpy as np
import pytest

from rooms.mesh import MeshGeometry
from rooms.rays import trace_energy
from rooms.transport import FINE, find_places, pair_energy, transport_of

C = 343.2
SIZE = np.array([6.0, 5.0, 3.0])


def corner_energy(a, b, rough, smooth=(), *, rays=8000, room=None, **changes):
    """Return the energy scattered at least once by walls beside the origin.

    Those of axes `rough` scatter all, those of `smooth` nothing of what they keep, 0.8;
    all others absorb.
    """
    room = MeshGeometry.box(SIZE) if room is None else room
    names = ["x0", "y0", "floor"]
    rows = [[room.surface_names.index(names[k]) for k in w] for w in (rough, smooth)]
    absorption, scattering = np.ones((room.surfaces, 1)), np.zeros((room.surfaces, 1))
    absorption[rows[0] + rows[1]], scattering[rows[0]] = 0.2, 1.0
    return trace_energy(
        room,
        absorption,
        scattering,
        [a],
        [b],
        **{
            "rays": rays,
            "duration": 0.04,
            "time_step": 0.0005,
            "speed_of_sound": C,
            "skip_specular_up_to": 3,
            **changes,
        },
    ).energy[0, 0, 0]


def flux(place, x, y):
    """Return what comes from a place to points of the floor."""
    square = (x - place[0]) ** 2 + (y - place[1]) ** 2 + place[2] ** 2
    return place[2] / square**1.5


@pytest.mark.parametrize("gap", [0.02, 0.2, 0.5])
@pytest.mark.parametrize("walls", [1, 2])
def test_what_one_wall_scatters_and_others_mirror_is_the_integral(gap, walls):
    a = np.array([gap, 2.4, gap])
    b = np.array([1.2 * gap, 2.4 + 0.3 * gap, 0.9 * gap])
    if walls == 2:
        a[1], b[1] = 0.8 * gap, 1.3 * gap
    energy = corner_energy(a, b, [2], [0, 1])
    # finest at the places: middles of cells that grow away from them
    edges = [np.sinh(np.linspace(-8, 8, 801)) for _ in range(2)]
    edges = [
        np.unique(np.clip(e / e[-1] * s + m, 0, s))
        for e, s, m in zip(edges, SIZE, (a + b) / 2, strict=False)
    ]
    x, y = ((e[1:] + e[:-1]) / 2 for e in edges)
    wide = np.outer(*(np.diff(e) for e in edges))
    x, y = np.meshgrid(x, y, indexing="ij")
    sums = [
        sum(
            (0.8 if i else 1.0)
            * (0.8 if j else 1.0)
            * flux(place * [1 - 2 * i, 1 - 2 * j, 1], x, y)
            for i in (0, 1)
            for j in (0, 1)
        )
        for place in (a, b)
    ]
    wanted = 0.8 / np.pi * np.sum(sums[0] * sums[1] * wide)
    np.testing.assert_allclose(energy.sum(), wanted, rtol=0.02)


@pytest.mark.parametrize("walls", [[0, 2], [0, 1, 2]])
def test_a_corner_has_no_length(walls):
    shape = np.array([0.9, 1.1, 1.0]), np.array([1.3, 0.8, 1.2])
    middle = np.array([0.0, 0.0 if 1 in walls else 2.5, 0.0])
    levels = []
    for gap in (0.02, 0.1, 0.25):
        a, b = (place * gap + middle for place in shape)
        energy = corner_energy(a, b, walls, rays=16_000).sum()
        levels.append(10 * np.log10(energy * gap**2))
    assert np.ptp(levels) < 0.25


def test_exchanging_the_ends_in_a_corner_changes_no_bit():
    rng = np.random.default_rng(3)
    room = MeshGeometry.extruded(
        [(0, 0), (6, 0), (6, 2.5), (3, 2.5), (3, 5), (0, 5)], 3
    )
    tables = rng.uniform(0.1, 0.6, (2, room.surfaces, 2, 3))
    places = np.array([[0.2, 0.3, 0.25], [0.1, 0.4, 0.2], [0.3, 0.2, 0.2]])
    options = {"rays": 400, "duration": 0.1, "time_step": 0.001, "speed_of_sound": C}
    there = trace_energy(room, tables[0], tables[1], places[:2], places[1:], **options)
    back = trace_energy(room, tables[0], tables[1], places[1:], places[:2], **options)
    np.testing.assert_array_equal(there.energy, back.energy.swapaxes(0, 1))
    np.testing.assert_array_equal(there.error, back.error.swapaxes(0, 1))
    np.testing.assert_array_equal(there.total_error, back.total_error.swapaxes(0, 1))


def box_energy(a, b, walls, steps=80):
    """Return the same as `corner_energy`, of the box by transport."""
    shares = np.ones((6, 1)), np.zeros((6, 1))
    rows = [2 * k for k in walls]
    shares[0][rows], shares[1][rows] = 0.2, 1.0
    box = transport_of(SIZE, shares[0], shares[1], C, 0.04, FINE)
    one, other = find_places(box, np.stack([a, b]))
    energy = pair_energy(box, one, other, 0.0005, steps)
    np.testing.assert_array_equal(energy, pair_energy(box, other, one, 0.0005, steps))
    return energy[:, 0] * 0.0005


@pytest.mark.parametrize("walls", [[0, 2], [0, 1, 2]])
@pytest.mark.parametrize("gap", [0.05, 0.3, 0.6])
def test_boxes_and_meshes_answer_alike_in_corners(walls, gap):
    middle = np.array([0.0, 0.0 if 1 in walls else 2.5, 0.0])
    a, b = (np.array(p) * gap + middle for p in ((0.9, 1.1, 1.0), (1.1, 0.8, 1.05)))
    wanted, got = corner_energy(a, b, walls, rays=16_000), box_energy(a, b, walls)
    assert abs(10 * np.log10(got.sum() / wanted.sum())) < 0.15
    late = [np.sum(e * np.arange(80)) / e.sum() * 0.0005 for e in (got, wanted)]
    assert abs(late[0] - late[1]) < 0.05 * late[1] + 0.0005


def test_sound_along_an_edge_is_not_blurred():
    a, b = np.array([0.2, 1.5, 0.2]), np.array([0.22, 2.6, 0.18])
    wanted, got = corner_energy(a, b, [0, 2], rays=16_000), box_energy(a, b, [0, 2])
    assert abs(10 * np.log10(got.sum() / wanted.sum())) < 0.25


def test_time_of_what_is_scattered_twice():
    # in a corner of two walls nothing arrives sooner than by the nearest wall
    a, b = np.array([0.2, 2.4, 0.2]), np.array([0.24, 2.5, 0.18])
    energy = corner_energy(a, b, [0, 2], time_step=0.0001)
    first = np.nonzero(energy)[0][0] * 0.0001
    nearest = min(
        np.linalg.norm(a - b * [1 - 2 * (k == 0), 1, 1 - 2 * (k == 2)]) for k in (0, 2)
    )
    assert nearest / C - 0.0001 < first < nearest / C + 0.0003
