"""Shortcuts of the tiles say what the long way says."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from inverse.late.even_tail import EvenTail, even_noise
from inverse.rows.tiles import Tiles

RATE, LENGTH = 16000.0, 8000


@pytest.fixture
def brief():
    """Rows that sound for the first 50 ms of half a second."""
    sound = np.random.default_rng(0).standard_normal((5, LENGTH))
    sound[:, 800:] = 0.0
    return sound


def split_energies(tiles, sound):
    return tiles.sums(tiles.split(sound) ** 2)


def test_silent_ends_change_no_energies(brief):
    tiles = Tiles(RATE, LENGTH)
    told = tiles.energies(brief)
    wanted = split_energies(tiles, brief)
    assert told.shape == wanted.shape
    assert_allclose(told.sum(axis=2), wanted.sum(axis=2), rtol=2e-3)
    assert (told[..., 40:] == 0).all()


def test_silent_ends_change_no_gained_sound(brief):
    tiles = Tiles(RATE, LENGTH)
    rng = np.random.default_rng(1)
    gains = rng.uniform(0.5, 2, (5, len(tiles.centers), tiles.bins))
    wanted = tiles._weighted(tiles.split(brief), gains)
    told = tiles.gained(brief, gains)
    assert ((told - wanted) ** 2).sum() < 1e-5 * (wanted**2).sum()


def test_comparing_splits_rows_once(brief):
    tiles = Tiles(RATE, 1600)
    measured, told = brief[:, :1600], brief[::-1, :1600] + brief[:, :1600]
    energies, products, wrong = tiles.compared(measured, told)
    assert_allclose(energies, tiles.energies(told), atol=1e-9)
    assert_allclose(products, tiles.products(measured, told), atol=1e-9)
    before = np.roll(told, 1, axis=0)
    assert_allclose(wrong, tiles.products(measured, before), atol=1e-9)


def test_one_sound_is_brought_to_the_energies_of_each_pair():
    tiles = Tiles(RATE, LENGTH)
    tail = EvenTail(0, RATE / 343.0, LENGTH, RATE)
    first, second = np.zeros((2, 3)), np.array([[1.0, 0, 0], [5.0, 0, 0]])
    energies = np.ones((2, len(tiles.centers), tiles.bins))
    energies *= np.exp(-0.05 * np.arange(tiles.bins)) * tiles.widths[:, None]
    sound = tail.brought(first, second, tiles, energies)
    assert (sound[0, :46] == 0).all()
    assert (sound[1, :233] == 0).all()
    told = tiles.energies(sound)[..., 5:-2]
    assert_allclose(np.log(told / energies[..., 5:-2]).mean(axis=2), 0, atol=0.15)
    back = tail.brought(second, first, tiles, energies)
    assert_array_equal(back, sound)


def test_long_even_noise_goes_back_and_forth():
    noise = even_noise(12000, RATE, seed=3)
    once = round(0.3 * RATE)
    assert_array_equal(noise[once : 2 * once - 2], noise[once - 2 : 0 : -1])
    assert noise.std() == pytest.approx(1.0, abs=0.05)
