"""Coloured, swinging and drifting noise under a decay."""

import numpy as np
import pytest

from analysis import acoustic_parameters
from hard_cases.decays import Decay, pink_noise

RATE = 48000


def rumble(count, rng):
    """Return noise of 6 dB less per octave from 10 Hz up, as a microphone gives."""
    spectrum = np.fft.rfft(rng.standard_normal(count))
    frequency = np.fft.rfftfreq(count, 1 / RATE)
    spectrum *= np.where(frequency < 10, 0.0, 1 / np.maximum(frequency, 10.0))
    wave = np.fft.irfft(spectrum, count)
    return wave / np.sqrt(np.mean(wave**2))


def drift(count, rng):
    time = np.linspace(0, 1, count)
    wave = rng.uniform(-1, 1) + rng.uniform(-2, 2) * time + 0.5 * time**2
    wave += 0.05 * rng.standard_normal(count)
    return wave / np.sqrt(np.mean(wave**2))


def swinging(count, rng):
    swing = 1 + 0.6 * np.sin(
        2 * np.pi * 1.5 * np.arange(count) / RATE + 3 * rng.random()
    )
    wave = rng.standard_normal(count) * swing
    return wave / np.sqrt(np.mean(wave**2))


@pytest.mark.parametrize("floor_db", [-50, -40, -35])
@pytest.mark.parametrize("noise", [pink_noise, rumble, drift, swinging])
def test_times_are_right_or_refused(noise, floor_db):
    rng = np.random.default_rng(3)
    for time in (0.4, 0.7, 1.2):
        clean = Decay((time,)).samples(int(3 * time * RATE), rng)
        noisy = clean + 10 ** (floor_db / 20) * noise(len(clean), rng)
        found = acoustic_parameters(noisy, RATE)
        for name in ("EDT", "T20", "T30"):
            if np.isfinite(found[name]):
                np.testing.assert_allclose(found[name], time, rtol=0.05)
            else:
                assert found["reasons"][name]
                assert found["flags"]


@pytest.mark.parametrize("floor_db", [-45, -30])
def test_a_drifting_offset_is_taken_off(floor_db):
    rng = np.random.default_rng(0)
    clean = Decay((0.8,)).samples(2 * RATE, rng)
    found = acoustic_parameters(
        clean + 10 ** (floor_db / 20) * drift(len(clean), rng), RATE
    )
    assert "dc_offset" in found["flags"]
    np.testing.assert_allclose(found["T20"], 0.8, rtol=0.01)
    np.testing.assert_allclose(found["T30"], 0.8, rtol=0.01)


def test_a_decay_of_one_sign_is_no_drift():
    decay = 10 ** (-3 * np.arange(RATE) / RATE / 0.5)
    found = acoustic_parameters(decay, RATE)
    assert found["flags"] == []
    np.testing.assert_allclose(found["T30"], 0.5, rtol=1e-3)


def test_a_masked_sample_refuses_its_row_and_a_rate_may_be_broken():
    rows = np.ma.MaskedArray(
        [Decay((0.5,)).samples(RATE, np.random.default_rng(k)) for k in range(2)]
    )
    rows[1, 5] = np.ma.masked
    found = acoustic_parameters(rows, RATE / 1.001)
    np.testing.assert_allclose(found["T30"], [0.5 * 1.001, np.nan], rtol=2e-3)
    assert found["flags"] == [[], ["non_finite"]]
