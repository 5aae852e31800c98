"""Responses of ends that were put up again a little elsewhere."""

import numpy as np
import pytest

from analysis import paper_metrics
from analysis.likeness.arrivals import split_arrivals
from analysis.likeness.bandwise import noise_density, third_octaves
from analysis.likeness.displacement import coherence, displaced
from analysis.likeness.floor import predicted_floor
from rir import Pose
from rooms import World
from rooms.presets import load_room

RATE = 16000


def diffuse(rng, seconds=0.6):
    time = np.arange(round(seconds * RATE)) / RATE
    return rng.standard_normal(len(time)) * 10 ** (-3 * time / 0.8)


def test_mean_coherence_of_many_moves_is_gaussian():
    rng = np.random.default_rng(0)
    k = np.array([10.0, 100.0, 200.0])
    sigma = 0.003
    moves = rng.normal(0, sigma * np.sqrt(2), (20000, 2, 3))
    mean = np.mean([coherence(k, m) for m in moves], axis=0)
    np.testing.assert_allclose(mean, np.exp(-2 * (k * sigma) ** 2), atol=0.01)


def test_arrivals_and_rest_are_the_response():
    rng = np.random.default_rng(1)
    h = 0.01 * diffuse(rng)
    h[[400, 700]] += [1.0, -0.5]
    arrivals, rest = split_arrivals(h, RATE)
    assert [a.middle for a in arrivals] == [400, 700]
    for a in arrivals:
        rest[a.start : a.start + len(a.samples)] += a.samples
    np.testing.assert_allclose(rest, h, atol=1e-15)


def test_noise_density_is_the_power():
    noise = np.random.default_rng(2).standard_normal(4000)
    np.testing.assert_allclose(noise_density(noise, 501).mean(), 1.0, rtol=0.1)


def test_a_lone_arrival_keeps_its_shape():
    h = np.zeros(4000)
    h[160] = 1.0
    rng = np.random.default_rng(3)
    moved = displaced(h, RATE, rng, 0.01)
    np.testing.assert_allclose(np.sum(moved**2), 1.0, rtol=0.1)
    apart = np.abs(np.arange(4000) - 160) > 40
    assert np.max(np.abs(moved[apart])) < 1e-2


def test_dense_part_keeps_energy_and_loses_coherence_as_derived():
    rng = np.random.default_rng(4)
    sigma, sums = 0.004, np.zeros((3, round(0.6 * RATE) // 2 + 1))
    for h in [diffuse(rng) for _ in range(12)]:
        a, b = np.fft.rfft(h), np.fft.rfft(displaced(h, RATE, rng, sigma))
        cross, own, other = (x * y.conj() for x, y in ((a, b), (a, a), (b, b)))
        sums = sums + np.array([cross.real, own.real, other.real])
    f = np.fft.rfftfreq(round(0.6 * RATE), 1 / RATE)
    for low, high in ((250, 500), (1000, 1500), (2000, 2500), (5000, 6000)):
        cross, own, other = sums[:, (f > low) & (f < high)].sum(axis=1)
        expected = np.exp(-2 * (2 * np.pi * (low + high) / 2 / 343 * sigma) ** 2)
        np.testing.assert_allclose(cross / own, expected, atol=0.08)
        np.testing.assert_allclose(other / own, 1.0, atol=0.1)


def test_noise_is_not_displaced():
    rng = np.random.default_rng(5)
    noise = 1e-3 * rng.standard_normal(16000)
    h = noise.copy()
    h[200] += 1.0
    change = displaced(h, RATE, rng, 0.01) - h
    assert np.std(change[2000:]) < 0.3e-3


def test_squared_weights_add_up_at_every_rate():
    for rate in (8000, 44100, 96000):
        total = np.zeros(3001)
        for band in third_octaves(rate, 6000):
            total[band.bins] += band.weights**2
        np.testing.assert_allclose(total, 1.0)


@pytest.mark.parametrize("sigma_mm", [1.0, 10.0])
def test_floor_is_what_a_simulated_session_measures(sigma_mm):
    rng = np.random.default_rng(6)
    # places anywhere: nothing stands in the way
    room = load_room("kitchen").model_copy(update={"furniture": ()})
    world = World(room, sample_rate=RATE, duration=0.5)
    measured, sides = [], ([], [])
    for _ in range(48):
        ends = rng.uniform(0.5, np.array(room.size_m) - 0.5, (2, 3))
        for side, (k, m) in zip(sides, ((0, 1), (1, 0)), strict=True):
            places = ends + rng.normal(0, sigma_mm / 1000, (2, 3))
            h = world.response(Pose.at(*places[k]), Pose.at(*places[m]))
            side.append(h + 2e-4 * rng.standard_normal(len(h)))
        measured.append(paper_metrics(sides[0][-1], sides[1][-1], RATE))
    floors = predicted_floor(
        *sides,
        RATE,
        rng,
        flavour="paper",
        symbols=["Amp", "Env", "STFT", "C50"],
        temperature_changes=[0.0] * 48,
        position_m=sigma_mm / 1000,
    )
    for symbol, tolerance in (("Amp", 0.2), ("Env", 0.25), ("STFT", 0.2), ("C50", 0.6)):
        mean = np.mean([m[symbol] for m in measured])
        np.testing.assert_allclose(floors[symbol], mean, rtol=tolerance)
