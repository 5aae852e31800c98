"""Common slopes: rates, maps and their symmetry against a closed form."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from inverse.late.features import PlaceFeatures
from inverse.late.late_maps import chi_square_bias, fit_maps
from inverse.late.slopes import common_rates, region_curves
from path_rooms import BoxRegions

ROOMS = np.array([[[0.0, 0, 0], [5, 4, 2.6]], [[5.0, 0, 0], [9, 4, 2.6]]])
TIMES = 0.07 + 0.02 * np.arange(36)
RATES = np.array([14.0, 60.0])
LEVEL = np.array([0.0, -2.3])
SHARE = np.array([0.4, -2.5])


def energies(emitters, listeners):
    """Two coupled rooms: one function of the room at both ends, per slope."""
    room = (emitters[:, 0] > 5).astype(int), (listeners[:, 0] > 5).astype(int)
    slow = np.exp(LEVEL[room[0]] + LEVEL[room[1]])
    fast = slow * SHARE[room[0]] * SHARE[room[1]]
    return np.outer(slow, np.exp(-RATES[0] * TIMES)) + np.outer(
        fast, np.exp(-RATES[1] * TIMES)
    )


def pairs(count, seed):
    rng = np.random.default_rng(seed)
    return tuple(rng.uniform([0.3, 0.3, 1], [8.7, 3.7, 2], (2, count, 3)))


def learned(seed=0, noise=False):
    emitters, listeners = pairs(150, seed)
    truth = energies(emitters, listeners)
    if noise:
        truth = truth * np.random.default_rng(seed).gamma(8, 1 / 8, truth.shape)
    regions = BoxRegions.of(ROOMS)
    curves = region_curves(truth, regions.numbers(emitters), regions.numbers(listeners))
    rates = common_rates(curves, TIMES)
    features = PlaceFeatures.of(np.vstack([emitters, listeners]), regions)
    ends = features(emitters), features(listeners)
    bias = chi_square_bias(400.0, 0.02) if noise else 0.0
    maps = fit_maps(np.log(truth) - bias, TIMES, *ends, rates, flags=2)
    return maps, features


def test_pooled_rates_are_found_with_amplitudes_of_either_sign():
    emitters, listeners = pairs(60, 3)
    found = common_rates(energies(emitters, listeners), TIMES)
    assert_allclose(found, RATES, rtol=0.08)


def test_one_rate_stays_one_in_noise():
    rng = np.random.default_rng(0)
    truth = np.outer(np.ones(40), np.exp(-14 * TIMES))
    found = common_rates(truth * rng.gamma(8, 1 / 8, truth.shape), TIMES)
    assert_allclose(found, [14.0], rtol=0.03)


def test_unseen_pairs_are_told_and_fade_ins_have_their_sign():
    maps, features = learned()
    emitters, listeners = pairs(200, 9)
    ends = features(emitters), features(listeners)
    told = maps.log_energies(*ends, TIMES)
    truth = np.log(energies(emitters, listeners))
    assert_allclose(told, truth, atol=0.12)
    shares = (ends[0] @ maps.shares.T) * (ends[1] @ maps.shares.T)
    across = (emitters[:, 0] > 5) != (listeners[:, 0] > 5)
    assert (shares[across] < 0).all()
    assert (shares[~across] > 0).all()


def test_noisy_bins_are_averaged_without_bias():
    maps, features = learned(noise=True)
    emitters, listeners = pairs(200, 9)
    told = maps.log_energies(features(emitters), features(listeners), TIMES)
    gap = told - np.log(energies(emitters, listeners))
    assert abs(gap.mean()) < 0.03
    assert gap.std() < 0.12


def test_ends_are_exchangeable_to_the_last_bit():
    maps, features = learned()
    emitters, listeners = pairs(50, 4)
    ends = features(emitters), features(listeners)
    assert_array_equal(
        maps.log_energies(*ends, TIMES), maps.log_energies(ends[1], ends[0], TIMES)
    )


def test_mean_log_of_a_bin_is_biased_as_chi_square_says():
    rng = np.random.default_rng(1)
    bandwidth, bin_s = 700.0, 0.02
    half = bandwidth * bin_s
    logs = np.log(rng.gamma(half, 1 / half, 200_000))
    assert_allclose(chi_square_bias(bandwidth, bin_s), logs.mean(), atol=2e-3)
