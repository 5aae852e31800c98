"""Sound strength against closed forms."""

import numpy as np
import pytest

from analysis import reference_energy, strength
from rir import SignalError

RATE = 48000


def free_field(distance):
    pulse = np.zeros(4800)
    pulse[round(distance / 343 * RATE)] = 1 / distance
    return pulse


def decay(time, scale=1.0, seed=0):
    sign = np.random.default_rng(seed).choice([-1.0, 1.0], 2 * RATE)
    return scale * sign * 10 ** (-3 * np.arange(2 * RATE) / RATE / time)


def test_a_source_at_ten_metres_has_strength_zero():
    reference = reference_energy(free_field(3.0), RATE, 3.0)
    np.testing.assert_allclose(reference, 0.01)
    angles = np.stack([1.5 * free_field(3.0), 0.5 * free_field(3.0)])
    np.testing.assert_allclose(reference_energy(angles, RATE, 3.0), 0.0125)


def test_strength_of_a_decay_is_its_energy_over_the_reference():
    response = np.stack([decay(0.8), decay(0.8, 0.1)])
    per_sample = 6 * np.log(10) / RATE / 0.8
    energy = 1 / -np.expm1(-per_sample)
    wanted = 10 * np.log10(energy / 0.01) + np.array([0, -20])
    np.testing.assert_allclose(strength(response, RATE, 0.01), wanted, atol=0.01)


def test_noise_below_the_decay_is_taken_off():
    noise = np.random.default_rng(1).normal(0, 10 ** (-40 / 20), 2 * RATE)
    quiet = strength(decay(0.5), RATE, 0.01)
    np.testing.assert_allclose(
        strength(decay(0.5) + noise, RATE, 0.01), quiet, atol=0.1
    )


def test_bands_of_a_white_decay_share_its_energy_by_their_width():
    centers = [500, 1000, 2000]
    reference = reference_energy(free_field(5.0), RATE, 5.0, centers)
    rows = np.stack([decay(1.0, seed=k) for k in range(40)])
    broad = strength(rows[0], RATE, 0.01)
    got = strength(rows, RATE, reference, centers).mean(axis=0)
    np.testing.assert_allclose(got, broad, atol=0.3)


def test_silence_has_no_strength_and_mistakes_are_told():
    assert np.isnan(strength(np.zeros(RATE), RATE, 0.01))
    with pytest.raises(SignalError, match="no sound"):
        reference_energy(np.zeros(100), RATE, 3.0)
    with pytest.raises(SignalError, match="distance"):
        reference_energy(np.ones(100), RATE, 0.0)
    with pytest.raises(SignalError, match="same centres"):
        strength(decay(0.5), RATE, 0.01, [500, 1000])
