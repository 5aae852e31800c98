import numpy as np
import pytest

from capture.session.pairing import (
    OneWay,
    arrival_difference,
    bands,
    judge_pair,
    noise_share,
    octave_distances,
    predicted_floor,
)
from capture.signal.stretch import apply_stretch, estimate_stretch
from capture.signal.sweep import synchronized_sweep

RATE = 16000
N = 8000
CENTERS = np.array([250.0, 500.0, 1000.0, 2000.0, 4000.0])


def arrivals(count: int = 1000, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return times [samples] and gains of a decaying, ever denser pattern."""
    rng = np.random.default_rng(seed)
    times = np.concatenate(([100.0], 100 + 5000 * rng.uniform(0, 1, count) ** 0.5))
    decay = np.exp(-times / 900)
    gains = decay * rng.choice([-1.0, 1.0], count + 1) / np.sqrt(count)
    gains[0] = 1.0
    return times, gains


def render(times: np.ndarray, gains: np.ndarray) -> np.ndarray:
    """Return the exact band-limited response of arrivals between samples."""
    n = 2 * N
    frequencies = np.fft.rfftfreq(n)
    fall = np.clip((0.46 - frequencies) / 0.06, 0, 1)
    spectrum = np.zeros(len(frequencies), dtype=complex)
    for part in np.array_split(np.arange(len(times)), 20):
        turns = np.exp(-2j * np.pi * np.outer(frequencies, times[part]))
        spectrum += turns @ gains[part]
    return np.fft.irfft(spectrum * np.sin(np.pi / 2 * fall) ** 2, n)[:N]


TIMES, GAINS = arrivals()
RESPONSE = render(TIMES, GAINS)


@pytest.mark.parametrize("kelvin", [0.0, 0.02, 0.1, 1.0])
def test_the_stretch_of_warmer_air_is_found(kelvin: float) -> None:
    stretch = 1.7e-3 * kelvin
    other = apply_stretch(RESPONSE, stretch, 0.05)
    found, shift = estimate_stretch(RESPONSE, other, RATE)
    np.testing.assert_allclose(found, stretch, atol=2e-6)
    np.testing.assert_allclose(shift, 0.05, atol=2e-3)


def test_the_stretch_is_found_in_noise() -> None:
    noise = np.random.default_rng(1).standard_normal(N)
    other = apply_stretch(RESPONSE, 1.7e-4, 0.0)
    other += noise * np.abs(RESPONSE).max() * 1e-4
    found, _ = estimate_stretch(RESPONSE, other, RATE)
    np.testing.assert_allclose(found, 1.7e-4, atol=5e-6)


def test_compensation_brings_a_warmer_response_back() -> None:
    reverse = apply_stretch(RESPONSE, 1.7e-4, 0.0)
    nothing = np.zeros(len(bands(RATE, 60, 7000)))
    figures = judge_pair(
        OneWay(RESPONSE, 20.0, nothing),
        OneWay(reverse, 20.1, nothing),
        RATE,
        band_hz=(60, 7000),
    )
    np.testing.assert_allclose(figures["stretch_ppm"], 170, atol=1)
    assert figures["measured_db"][-1] > -30
    assert figures["compensated_db"].max() < -60
    assert figures["doubts"] == []


def test_the_floor_predicts_what_placing_errors_do() -> None:
    rng = np.random.default_rng(2)
    sigma_m, c = 0.003, 343.2
    samples_per_m = RATE / c
    moved = TIMES + samples_per_m * sigma_m * np.sqrt(2) * rng.standard_normal(
        len(TIMES)
    )
    again = TIMES + samples_per_m * sigma_m * np.sqrt(2) * rng.standard_normal(
        len(TIMES)
    )
    measured = octave_distances(
        render(moved, GAINS)[200:], render(again, GAINS)[200:], RATE, CENTERS
    )
    predicted = predicted_floor(
        RESPONSE,
        RATE,
        CENTERS,
        noise=np.zeros(5),
        position_sigma_m=sigma_m,
        temperature_change_c=0.0,
    )
    np.testing.assert_allclose(predicted, measured, atol=2.0)


def test_the_floor_predicts_what_temperature_does() -> None:
    other = apply_stretch(RESPONSE, 0.5 / 293.15 * 0.1, 0.0)
    measured = octave_distances(RESPONSE, other, RATE, CENTERS)
    predicted = predicted_floor(
        RESPONSE,
        RATE,
        CENTERS,
        noise=np.zeros(5),
        position_sigma_m=0.0,
        temperature_change_c=0.1,
    )
    np.testing.assert_allclose(predicted, measured, atol=1.5)


def test_the_floor_predicts_what_noise_does() -> None:
    rng = np.random.default_rng(3)
    scale = 1e-3 * np.abs(RESPONSE).max()
    one, other = (RESPONSE + scale * rng.standard_normal(N) for _ in range(2))
    share = 10 ** (octave_distances(RESPONSE, one, RATE, CENTERS) / 10)
    predicted = predicted_floor(
        RESPONSE,
        RATE,
        CENTERS,
        noise=2 * share,
        position_sigma_m=0.0,
        temperature_change_c=0.0,
    )
    measured = octave_distances(one, other, RATE, CENTERS)
    np.testing.assert_allclose(predicted, measured, atol=0.7)


def test_a_wrong_stand_is_noticed() -> None:
    nothing = np.zeros(len(bands(RATE, 60, 7000)))
    later, gains = arrivals(seed=9)
    other = render(later + 30, gains)
    doubts = judge_pair(
        OneWay(RESPONSE, np.nan, nothing),
        OneWay(other, np.nan, nothing),
        RATE,
        band_hz=(60, 7000),
    )["doubts"]
    assert "was the wrong stand moved?" in doubts[0]
    assert "are the stands at the right places?" in doubts[1]


@pytest.mark.parametrize("delay", [97.0, 100.0, 100.25, 103.5, 120.0])
def test_the_arrival_follows_fractions_of_a_sample(delay: float) -> None:
    response = render(np.array([delay]), np.array([1.0]))
    whole = render(np.array([100.0]), np.array([1.0]))
    moved = RATE * arrival_difference(whole, response, RATE)
    np.testing.assert_allclose(moved, delay - 100.0, atol=0.05)


def test_octaves_stay_inside_the_band() -> None:
    assert bands(48000, 40, 20000).tolist() == [
        63.0,
        125.0,
        250.0,
        500.0,
        1000.0,
        2000.0,
        4000.0,
        8000.0,
    ]
    assert bands(16000, 60, 7000).tolist() == [125, 250, 500, 1000, 2000, 4000]


def test_the_silence_before_a_sweep_tells_the_noise_in_the_response() -> None:
    played = np.asarray(synchronized_sweep(30, 7500, 2.0, RATE, band=(60, 7000)))
    rng = np.random.default_rng(4)
    noise = 1e-3 * rng.standard_normal(len(played) + 2 * RATE)
    n = len(played) + len(noise)
    divided = np.fft.rfft(noise[RATE:], n) / np.fft.rfft(played, n)
    frequencies = np.fft.rfftfreq(n, 1 / RATE)
    inside = (frequencies > 80) & (frequencies < 7000)
    rest = np.fft.irfft(divided * inside, n)[:N]
    expected = 10 ** (octave_distances(RESPONSE, RESPONSE + rest, RATE, CENTERS) / 10)
    found = noise_share(noise[:RATE], played, RESPONSE, RATE, CENTERS)
    np.testing.assert_allclose(10 * np.log10(found / expected), 0.0, atol=1.5)
