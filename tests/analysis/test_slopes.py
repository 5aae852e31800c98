import os
from pathlib import Path

import numpy as np
import pytest

from analysis import acoustic_parameters
from analysis.slopes import fit_slopes
from rir.files.audio import read_audio

RATE = 48000
DATA = Path(
    os.environ.get(
        "RESOUNDING_DATA", Path(__file__).parents[2].parent / "shared" / "data"
    )
)


def two_slopes(early, late, knee_db, rng, seconds=3.0):
    time = np.arange(int(seconds * RATE)) / RATE
    power = 10 ** (-6 * time / early) + 10 ** (knee_db / 10 - 6 * time / late)
    noise = 3e-4 * rng.standard_normal(len(time))
    return rng.standard_normal(len(time)) * np.sqrt(power) + noise


@pytest.mark.parametrize("knee_db", [-10, -20, -30])
def test_two_slopes_are_found_with_their_levels(knee_db):
    wave = two_slopes(0.4, 1.5, knee_db, np.random.default_rng(0))
    found = fit_slopes(wave, RATE)
    assert found.count == 2
    np.testing.assert_allclose(found.times, [0.4, 1.5], rtol=0.06)
    np.testing.assert_allclose(found.levels[1], knee_db, atol=1.5)
    np.testing.assert_allclose(found.levels[0], 0.0, atol=1.0)


def test_one_slope_stays_one():
    rng = np.random.default_rng(1)
    time = np.arange(2 * RATE) / RATE
    waves = rng.standard_normal((20, len(time))) * 10 ** (-3 * time / 0.7)
    waves += 1e-3 * rng.standard_normal(waves.shape)
    found = fit_slopes(waves, RATE)
    assert np.sum(found.count == 2) <= 1
    one = found.count == 1
    np.testing.assert_allclose(np.nanmin(found.times, axis=-1)[one], 0.7, rtol=0.05)


def test_no_decay_has_no_slope():
    found = fit_slopes(np.zeros((2, 4000)), RATE)
    assert found.count.tolist() == [0, 0]
    assert np.isnan(found.times).all()


def test_coupled_rooms_measured_are_recognised():
    path = DATA / "decay_double_slope" / "doubleslope_RIR_200cm.wav"
    if not path.exists():
        pytest.skip(f"no measured double slope under {DATA}")
    samples, rate = read_audio(path)
    found = fit_slopes(samples, rate)
    assert np.mean(found.count == 2) > 0.9
    flags = acoustic_parameters(samples, rate)["flags"]
    assert np.mean(["curved_decay" in words for words in flags]) > 0.7


def test_measured_office_is_plausible():
    path = DATA / "polimi_ula" / "derived_polimi_16k_0.4s.npz"
    if not path.exists():
        pytest.skip(f"no measured office under {DATA}")
    with np.load(path) as file:
        found = acoustic_parameters(file["rir"], int(file["fs"]))
    assert 0.3 < np.nanmedian(found["T20"]) < 0.55
    assert np.all((found["DRR"] > -6) & (found["DRR"] < 30))
    assert not np.any(found["EDT"] < 0.02)
