from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from inverse.bands.band_fit import BandData
from inverse.bands.banded_room import BandedRoom
from inverse.bands.half_octaves import HalfOctaves
from inverse.bands.scatterers import Scatterers
from inverse.objects.scatter_fit import find_scatterers, with_scatterers
from inverse.paths.bank import ideal_bank
from inverse.paths.oriented_box import OrientedBox
from inverse.paths.room import OMNI, BoxRoom
from rir import Poses

SIZE, RATE, SPEED, SAMPLES = np.array([3.0, 2.6, 2.2]), 8000.0, 343.0, 400
PLACES = np.array([[0.9, 1.9, 0.6], [2.2, 0.8, 1.4]])


def drawn_poses(rng, count):
    turns = rng.standard_normal((count, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    return Poses(rng.uniform(0.3, SIZE - 0.3, (count, 3)), turns)


@pytest.fixture(scope="module")
def banded():
    box = OrientedBox(np.eye(3), SIZE / 2, -SIZE / 2, SIZE / 2, np.ones(6))
    factors = np.array([0.9, 0.8, 0.85, 0.8, 0.7, 0.85])
    room = BoxRoom(box, SPEED, 0.0, factors, OMNI, OMNI, ideal_bank(36), RATE, order=2)
    grid = HalfOctaves(RATE, SAMPLES)
    rng = np.random.default_rng(0)
    emitting = np.tile(np.sqrt(4 * np.pi) * np.array([0.7, 0, 0, 0.2]), (grid.bands, 1))
    return BandedRoom(
        room,
        grid,
        rng.uniform(0.7, 0.9, (grid.bands, 6)).astype(complex),
        False,
        np.full(grid.bands, 1e-3),
        np.zeros(grid.bands),
        emitting,
        np.tile(OMNI, (grid.bands, 1)),
        np.ones(len(grid.hertz), dtype=complex),
    )


@pytest.fixture(scope="module")
def furnished(banded):
    gains = np.full((banded.grid.bands, 2), 0.12 + 0.02j)
    return replace(banded, scatterers=Scatterers(PLACES, gains))


def heard(banded, rng, rows=64, noise=0.02):
    """Rows of the room, and as much noise as a share of their direct sound."""
    emitters, listeners = drawn_poses(rng, rows), drawn_poses(rng, rows)
    flat = np.ones(len(banded.grid.hertz))
    spectra = banded.images(emitters, listeners)
    responses = np.fft.irfft(spectra, banded.grid.size)
    responses += noise * rng.standard_normal(responses.shape)
    targets = banded.grid.split(np.fft.rfft(responses), flat)
    live = np.ones(banded.grid.total, dtype=bool)
    power = np.add.reduceat(np.abs(targets) ** 2, banded.grid.starts, axis=1)
    return BandData(emitters, listeners, targets, flat, live, power)


def test_a_point_without_walls_arrives_by_way_of_itself(banded):
    silent = replace(
        banded, walls=np.zeros_like(banded.walls), emitting=banded.listening
    )
    point = np.array([[1.2, 1.5, 1.0]])
    gains = np.full((banded.grid.bands, 1), 0.3 + 0j)
    emitter, listener = Poses.of([[0.5, 0.5, 0.5]]), Poses.of([[2.5, 2.0, 1.8]])
    with_point = replace(silent, scatterers=Scatterers(point, gains))
    sent = with_point.images(emitter, listener) - silent.images(emitter, listener)
    legs = [np.linalg.norm(point[0] - end.positions[0]) for end in (emitter, listener)]
    hertz = banded.grid.hertz
    expected = 0.3 / np.prod(legs) * np.exp(-1e-3 * sum(legs))
    expected = expected * np.exp(-2j * np.pi * hertz * sum(legs) / SPEED)
    clear = (hertz > 200) & (hertz < 2500)
    assert_allclose(sent[0, clear], expected[clear], atol=0.02 * np.abs(expected[0]))


def test_exchanged_ends_are_told_alike(furnished):
    rng = np.random.default_rng(1)
    both = rng.standard_normal((furnished.grid.bands, 4))
    same = replace(furnished, emitting=both, listening=both)
    ends = drawn_poses(rng, 3), drawn_poses(rng, 3)
    one, other = same.images(*ends), same.images(*ends[::-1])
    assert np.abs(one - other).max() < 1e-10 * np.abs(one).max()


def test_points_are_found_with_their_gains(banded, furnished):
    data = heard(furnished, np.random.default_rng(2))
    found = find_scatterers(data, banded)
    gap = np.linalg.norm(found.points[:, None] - PLACES, axis=2)
    assert len(found) == 2
    assert gap.min(axis=0).max() < 0.01
    middle = np.argmin(np.abs(banded.grid.centers - 1000))
    assert_allclose(found.gains[middle], 0.12 + 0.02j, atol=0.02)


def test_noise_and_wrong_walls_hold_no_points(banded):
    rng = np.random.default_rng(3)
    assert len(find_scatterers(heard(banded, rng, noise=0.1), banded)) == 0
    data = heard(banded, rng)
    wrong = replace(banded, walls=0.95 * banded.walls)
    assert with_scatterers(data, wrong) is wrong


def test_points_are_kept_in_a_file(furnished):
    again = BandedRoom.from_arrays(furnished.room, furnished.as_arrays())
    assert again.scatterers is not None
    assert_array_equal(again.scatterers.points, furnished.scatterers.points)
    bare = replace(furnished, scatterers=None)
    assert BandedRoom.from_arrays(bare.room, bare.as_arrays()).scatterers is None
