from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from inverse.bands.band_fit import BandData
from inverse.bands.banded_room import BandedRoom
from inverse.bands.half_octaves import HalfOctaves
from inverse.bands.occluders import Occluders, voxels_of
from inverse.bands.occlusion_kernel import cross_voxels
from inverse.bands.scatterers import Scatterers
from inverse.objects.found_objects import FoundObjects
from inverse.objects.tomography import GROUPS_HZ, find_occluders
from inverse.paths.bank import ideal_bank
from inverse.paths.oriented_box import OrientedBox
from inverse.paths.room import OMNI, BoxRoom
from inverse.plan.ground_plan import GroundPlan
from inverse.plan.plan_plot import draw_plan
from rir import Poses

SIZE, RATE, SAMPLES = np.array([4.0, 3.0, 2.5]), 16000.0, 640
LOW, HIGH = np.array([1.5, 1.0, 0.0]), np.array([2.5, 2.0, 1.0])


@pytest.fixture(scope="module")
def room():
    box = OrientedBox(np.eye(3), SIZE / 2, -SIZE / 2, SIZE / 2, np.ones(6))
    plain = BoxRoom(
        box, 343.0, 0.0, np.ones(6), OMNI, OMNI, ideal_bank(36), RATE, order=2
    )
    grid = HalfOctaves(RATE, SAMPLES)
    return BandedRoom(
        plain,
        grid,
        np.full((grid.bands, 6), 0.7 + 0j),
        False,
        np.zeros(grid.bands),
        np.zeros(grid.bands),
        np.tile(OMNI, (grid.bands, 1)),
        np.tile(OMNI, (grid.bands, 1)),
        np.ones(len(grid.hertz), dtype=complex),
    )


@pytest.fixture(scope="module")
def block(room):
    """A cubic metre that keeps 1.2 nepers of each metre."""
    shape = voxels_of(room.room.box)
    at = (np.indices(tuple(shape)).transpose(1, 2, 3, 0) + 0.5) * SIZE / shape
    inside = ((at > LOW) & (at < HIGH)).all(axis=-1).ravel()
    hertz = np.array([np.sqrt(low * high) for low, high in GROUPS_HZ])
    depths = np.where(np.tile(inside, (len(hertz), 1)), 1.2, 0.0)
    return Occluders(shape, hertz, depths)


def drawn(rng, count):
    tried = rng.uniform([0.3, 0.3, 0.2], [3.7, 2.7, 1.2], (6 * count, 3))
    return tried[((tried < LOW) | (tried > HIGH)).any(axis=1)][:count]


def heard(room, rng, rows=100):
    emitters, listeners = Poses.of(drawn(rng, rows)), Poses.of(drawn(rng, rows))
    spectra = room.images(emitters, listeners)
    responses = np.fft.irfft(spectra, room.grid.size)
    responses += 0.005 * rng.standard_normal(responses.shape)
    flat = np.ones(len(room.grid.hertz))
    targets = room.grid.split(np.fft.rfft(responses), flat)
    live = np.ones(room.grid.total, dtype=bool)
    power = np.add.reduceat(np.abs(targets) ** 2, room.grid.starts, axis=1)
    return BandData(emitters, listeners, targets, flat, live, power)


def test_lengths_through_voxels_add_up_and_fold_at_walls():
    shape, step = np.array([4, 3, 2]), np.array([0.5, 0.5, 0.5])
    voxels, lengths = np.zeros(64, dtype=np.int64), np.zeros(64)
    start, way = np.array([0.2, 0.3, 0.4]), np.array([-3.0, 2.6, 1.7])
    n = cross_voxels(start, way, step, shape, voxels, lengths)
    assert_allclose(lengths[:n].sum(), np.linalg.norm(way))
    assert voxels[:n].min() >= 0
    assert voxels[:n].max() < 24
    # along x from 0.2 m to -0.2 m: out and back through the first voxel
    n = cross_voxels(start, np.array([-0.4, 0, 0]), step, shape, voxels, lengths)
    assert_array_equal(voxels[:n], 0)
    assert_allclose(lengths[:n], 0.2)


def test_a_direct_sound_loses_what_stands_in_its_way(room, block):
    alone = replace(room, room=room.room.with_order(0, 0))
    ends = Poses.of([[1.0, 1.5, 0.5]]), Poses.of([[3.0, 1.5, 0.5]])
    free, shaded = alone.images(*ends), replace(alone, occluders=block).images(*ends)
    clear = (room.grid.hertz > 900) & (room.grid.hertz < 5000)
    ratio = np.abs(shaded[0, clear] / free[0, clear])
    assert_allclose(ratio, np.exp(-1.2), rtol=0.03)


def test_exchanged_ends_are_told_alike(room, block):
    rng = np.random.default_rng(1)
    shaded = replace(room, occluders=block)
    ends = Poses.of(drawn(rng, 4)), Poses.of(drawn(rng, 4))
    one, other = shaded.images(*ends), shaded.images(*ends[::-1])
    assert np.abs(one - other).max() < 1e-10 * np.abs(one).max()


def test_a_block_is_found_where_it_stands_and_nothing_where_none_is(room, block):
    rng = np.random.default_rng(2)
    found = find_occluders(heard(replace(room, occluders=block), rng), room)
    assert found is not None
    both = (found.solid & block.solid).sum() / (found.solid | block.solid).sum()
    assert both > 0.4
    (low, high) = max(
        found.blocks(room.room.box), key=lambda ends: np.prod(ends[1] - ends[0])
    )
    assert_allclose(low + SIZE / 2, LOW, atol=0.3)
    assert_allclose(high + SIZE / 2, HIGH, atol=0.3)
    assert find_occluders(heard(room, rng), room) is None


def test_what_was_found_is_kept_and_drawn(room, block, tmp_path):
    gains = np.full((room.grid.bands, 1), 0.1 + 0j)
    points = Scatterers(np.array([[1.0, 2.0, 0.7]]), gains)
    full = replace(room, occluders=block, scatterers=points)
    again = BandedRoom.from_arrays(room.room, full.as_arrays())
    assert again.occluders is not None
    assert_array_equal(again.occluders.depths, block.depths)
    found = FoundObjects.of(again)
    told = found.as_dict()
    assert_allclose(told["blocks"][0]["corner"], LOW, atol=0.13)
    assert_allclose(told["points"], [[1.0, 2.0, 0.7]])
    one = np.array([[1.0, 1.0]])
    plan = GroundPlan(
        [], one, one + 1, np.zeros((0, 2, 2)), 1.0, 0.1, "SIMULATED", furnishing=found
    )
    draw_plan(tmp_path / "plan.png", plan)
    plan.save(tmp_path / "plan.json")
    assert (tmp_path / "plan.png").stat().st_size > 1000
    assert '"blocks"' in (tmp_path / "plan.json").read_text()
    assert not FoundObjects.of(None)
