"""A second take of the same response: noise replaced, never added."""

import numpy as np

from analysis.likeness.retake import retaken, steady_part

RATE = 16000


def take(rng, level=1e-3, count=16000):
    time = np.arange(count) / RATE
    signal = rng.standard_normal(count) * 10 ** (-3 * time / 0.4)
    return signal, signal + level * rng.standard_normal(count)


def test_energy_over_time_stays():
    rng = np.random.default_rng(0)
    ratios = []
    for _ in range(8):
        _, h = take(rng)
        noise = steady_part(h, RATE)
        again = retaken(h, noise, noise, RATE, rng)
        pairs = zip(np.array_split(again, 10), np.array_split(h, 10), strict=True)
        ratios.append([np.sum(a**2) / np.sum(b**2) for a, b in pairs])
    np.testing.assert_allclose(np.mean(ratios, axis=0), 1.0, atol=0.15)


def test_difference_is_the_noise_of_two_takes():
    rng = np.random.default_rng(1)
    _, h = take(rng)
    noise = steady_part(h, RATE)
    change = retaken(h, noise, noise, RATE, rng) - h
    for part in (change[:3000], change[12000:]):
        np.testing.assert_allclose(np.std(part), np.sqrt(2) * 1e-3, rtol=0.15)


def test_a_noisier_other_take_is_noisier():
    rng = np.random.default_rng(2)
    _, h = take(rng, level=1e-4)
    loud = 1e-2 * rng.standard_normal(1600)
    again = retaken(h, steady_part(h, RATE), loud, RATE, rng)
    np.testing.assert_allclose(np.std(again[12000:]), 1e-2, rtol=0.1)


def test_steady_part_reaches_back_to_the_decay():
    rng = np.random.default_rng(3)
    _, h = take(rng)
    # The decay meets the noise at 60 dB, after 0.4 s.
    assert 6000 < len(steady_part(h, RATE)) < 10500
    assert len(steady_part(take(rng, level=0.0)[1], RATE)) == 1600


def test_silence_stays_silent():
    h = np.zeros(8000)
    h[100] = 1.0
    again = retaken(h, np.zeros(800), np.zeros(800), RATE, np.random.default_rng(4))
    np.testing.assert_allclose(again, h, atol=1e-9)
