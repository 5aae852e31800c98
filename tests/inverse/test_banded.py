import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from inverse.acoustics import Acoustics
from inverse.banded_fit import start_banded
from inverse.bands.band_fit import _moved, _sums, band_data
from inverse.bands.half_octaves import HalfOctaves
from inverse.find import room_in_rows
from inverse.paths.bank import ideal_bank
from inverse.paths.room import OMNI, BoxRoom
from inverse.rows.direct import read_direct
from path_rooms import level_errors

WALLS = np.array([0.9, 0.8, 0.85, 0.8, 0.7, 0.85])


@pytest.fixture(scope="module")
def plain(centred_box):
    return BoxRoom(
        centred_box,
        343.2,
        0.0,
        WALLS,
        OMNI.copy(),
        OMNI,
        ideal_bank(36),
        16000.0,
        order=6,
    )


@pytest.fixture(scope="module")
def started(box_set, plain):
    rows = box_set.rows(np.array([0, 40, 80]))
    banded = start_banded(rows, read_direct(box_set), plain, angled=True)
    return rows, banded


def test_half_octaves_add_up():
    grid = HalfOctaves(16000.0, 800)
    rng = np.random.default_rng(0)
    spectra = np.fft.rfft(rng.standard_normal((2, 800)), grid.size)
    joined = grid.joined(grid.split(spectra, np.ones(spectra.shape[1])))
    assert_allclose(joined, spectra * grid.masks.sum(axis=0), atol=1e-9)


def test_even_walls_render_as_the_plain_room_does(started, plain):
    from dataclasses import replace

    rows, banded = started
    flat = replace(
        banded,
        room=plain,
        angled=False,
        walls=np.tile(WALLS.astype(complex), (banded.grid.bands, 1)),
        loss=np.zeros(banded.grid.bands),
        source=np.ones(len(banded.grid.hertz), dtype=complex),
    )
    ends = rows.emitters, rows.listeners
    first = np.fft.rfft(flat.render(*ends, rows.n_samples))
    second = np.fft.rfft(plain.render(*ends, rows.n_samples))
    hertz = np.fft.rfftfreq(rows.n_samples, 1 / 16000)
    heard = (hertz > 150) & (hertz < 6000)
    gap = (np.abs(first - second)[:, heard] ** 2).sum()
    assert gap < 10**-2.8 * (np.abs(second)[:, heard] ** 2).sum()


def test_exchanged_ends_are_told_alike(started):
    from dataclasses import replace

    rows, banded = started
    rng = np.random.default_rng(1)
    both = rng.standard_normal((banded.grid.bands, 4))
    same = replace(banded, emitting=both, listening=both)
    ends = rows.emitters, rows.listeners
    one, other = same.images(*ends), same.images(*ends[::-1])
    assert np.abs(one - other).max() < 1e-10 * np.abs(one).max()


def test_derivatives_are_those_of_the_misfit(started):
    rows, banded = started
    data = band_data(rows, banded.grid, banded.source)
    weights = np.ones((len(rows), banded.grid.bands))
    every = np.ones(banded.grid.bands, dtype=bool)
    _, right, _ = _sums(data, banded, weights, every)
    for column in (0, 3, 12, 13, 14):
        step = np.zeros_like(right)
        step[:, column] = 1e-6
        up = _sums(data, _moved(banded, step), weights, every)[2].sum(axis=0)
        down = _sums(data, _moved(banded, -step), weights, every)[2].sum(axis=0)
        slope = (up - down) / 2e-6
        assert_allclose(slope, -2 * right[:, column], rtol=1e-3, atol=1e-3)


def test_one_band_alone_is_rendered_as_among_others(started):
    rows, banded = started
    kernels = banded.kernels(np.ones(len(banded.grid.hertz)))
    ends = rows.emitters, rows.listeners
    whole = banded.envelopes(*ends, kernels)
    alone = np.arange(banded.grid.bands) == 9
    told = banded.envelopes(*ends, kernels, alone)
    start = int(banded.grid.starts[9])
    here = slice(start, start + int(banded.grid.lengths[9]))
    assert_array_equal(told[:, here], whole[:, here])
    assert not np.delete(told, np.r_[here], axis=1).any()


def test_curvature_of_phase_is_the_energy_of_what_is_told(started):
    from inverse.bands.band_kernel import PHASE

    rows, banded = started
    data = band_data(rows, banded.grid, banded.source)
    weights = np.ones((len(rows), banded.grid.bands))
    every = np.ones(banded.grid.bands, dtype=bool)
    square, _, _ = _sums(data, banded, weights, every, sloped=False)
    told = banded.envelopes(data.emitters, data.listeners, banded.kernels(data.weight))
    power = np.add.reduceat(np.abs(told) ** 2, banded.grid.starts, axis=1)
    assert_allclose(square[:, PHASE, PHASE], power.sum(axis=0), rtol=1e-9)


@pytest.fixture(scope="module")
def unmoved(started):
    """Return a room and its places where they stand, low bands, and even weights."""
    from inverse.bands.band_places import PlaceFit

    rows, banded = started
    data = band_data(rows, banded.grid, banded.source)
    at = PlaceFit(banded, data, np.zeros((len(rows), 6)), np.zeros((11, 11)))
    return at, banded.grid.centers < 1500, np.ones((len(rows), banded.grid.bands))


def test_derivatives_by_geometry_and_places_are_those_of_the_misfit(started, unmoved):
    from inverse.bands.band_places import _moved as moved
    from inverse.bands.band_places import _sums as sums

    at, low, weights = unmoved
    _, right, _ = sums(at, low, weights, curved=False)
    # levels and slants move as well and are not counted
    for column, size in ((0, 1e-6), (4, 1e-6), (8, 1e-6), (9, 1e-4), (10, 1e-4)):
        step = np.zeros(11)
        step[column] = size
        up, down = (
            sums(moved(at, way * step, at.shifts), low, weights, curved=False)[2]
            for way in (1, -1)
        )
        slope = (up - down) / (2 * size)
        wanted = -2 * right[:, column]
        assert np.linalg.norm(slope - wanted) < 0.15 * np.linalg.norm(wanted)
    moves = np.zeros((len(started[0]), 6))
    moves[:, 2] = 1e-6
    up, down = (
        sums(moved(at, np.zeros(11), way * moves), low, weights, curved=False)[2]
        for way in (1, -1)
    )
    wanted = -2 * right[:, 13]
    gap = (up - down) / 2e-6 - wanted
    assert np.linalg.norm(gap) < 0.15 * np.linalg.norm(wanted)


def test_curvature_of_places_leads_where_slopes_lead(unmoved):
    from inverse.bands.band_places import _sums as sums

    at, low, weights = unmoved
    square, right, misfit = sums(at, low, weights)
    again = sums(at, low, weights, curved=False)
    assert not again[0].any()
    assert_allclose(again[1], right, rtol=1e-9)
    assert_allclose(again[2], misfit, rtol=1e-12)
    assert (np.linalg.eigvalsh(square) > -1e-9 * np.trace(square[0])).all()


@pytest.mark.slow
def test_walls_that_depend_on_angle_are_found(box_set, unseen_set, started):
    from dataclasses import replace

    _, banded = started
    ends = box_set.emitters, box_set.listeners
    truth = replace(banded, source=np.fft.rfft(np.eye(1, 9, 4)[0], banded.grid.size))
    rows = replace(box_set, responses=truth.render(*ends, box_set.n_samples))
    heard = room_in_rows(rows)
    ends = unseen_set.emitters, unseen_set.listeners
    wanted = truth.render(*ends, unseen_set.n_samples)
    told = heard.predict(*ends, unseen_set.n_samples)
    assert np.median(level_errors(wanted, told)) < -15
    again = Acoustics.from_arrays(heard.as_arrays())
    assert_array_equal(again.predict(*ends, 800), heard.predict(*ends, 800))
