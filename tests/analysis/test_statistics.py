"""Intervals and effect size."""

import numpy as np
import pytest

from analysis.statistics import (
    estimate_mean,
    interval_of_pseudo_values,
    pseudo_values,
    ratio_of_means,
    superiority,
)


def test_pseudo_values_of_independent_values_are_the_values():
    values = np.array([1.0, 4.0, 2.0])
    np.testing.assert_allclose(pseudo_values(values, np.arange(3)[:, None]), values)


@pytest.mark.parametrize("positive", [False, True])
def test_interval_covers_skewed_means(positive):
    rng = np.random.default_rng(0)
    hits = 0
    for _ in range(200):
        low, high = interval_of_pseudo_values(
            rng.exponential(size=20), rng, positive=positive
        )
        hits += low <= 1.0 <= high
    assert 0.90 <= hits / 200 <= 0.985


def test_interval_of_distances_stays_above_zero():
    values = np.r_[np.full(19, 0.01), 5.0] * np.linspace(0.9, 1.1, 20)
    low, high = interval_of_pseudo_values(
        values, np.random.default_rng(0), positive=True
    )
    assert 0 < low < values.mean() < high


def test_estimate_counts_what_is_undefined():
    rng = np.random.default_rng(0)
    values = np.array([1.0, 2.0, np.nan, 3.0])
    estimate = estimate_mean(values, np.arange(4)[:, None], rng)
    assert (estimate.mean, estimate.count, estimate.undefined) == (2.0, 3, 1)
    nothing = estimate_mean(np.full(3, np.nan), np.arange(3)[:, None], rng)
    assert np.isnan(nothing.mean)
    assert nothing.undefined == 3


def test_equal_values_have_a_point_interval_and_two_have_none():
    rng = np.random.default_rng(0)
    assert interval_of_pseudo_values(np.full(5, 2.0), rng) == (2.0, 2.0)
    assert np.isnan(interval_of_pseudo_values(np.array([1.0, 2.0]), rng)).all()


def test_ratio_interval_holds_a_known_ratio():
    rng = np.random.default_rng(1)
    paired = rng.uniform(0.9, 1.1, 30)
    index = np.array([(i, j) for i in range(30) for j in range(30) if i != j])
    unpaired = rng.uniform(9, 11, len(index))
    low, high = ratio_of_means(paired, np.arange(30)[:, None], unpaired, index, rng)
    assert low < 10 < high
    assert high / low < 1.1


def test_superiority_is_one_for_separated_and_half_for_equal():
    assert superiority(np.array([1.0, 2.0]), np.array([3.0, 4.0])) == 1.0
    assert superiority(np.array([1.0, 2.0]), np.array([1.0, 2.0])) == 0.5
