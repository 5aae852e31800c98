import numpy as np
import pytest

from analysis import acoustic_parameters, band_parameters
from hard_cases.bands import BandCase, gated_clarity, score_bands
from rir.bands import Band, bands_of
from rir.errors import SignalError

RATE = 48000
G = 10**0.3
# IEC 61260-1:2014 table 1, class 1: octave ratio exponent, least and most attenuation.
CLASS_1 = [
    (0, -0.4, 0.4),
    (1 / 8, -0.4, 0.5),
    (1 / 4, -0.4, 0.7),
    (3 / 8, -0.4, 1.4),
    (0.4999, -0.4, 5.3),
    (1, 16.6, np.inf),
    (2, 40.5, np.inf),
    (3, 60.0, np.inf),
    (4, 70.0, np.inf),
]


def breakpoint_ratio(exponent, fraction):
    """Return the frequency ratio of a mask breakpoint (IEC 61260-1, 5.10.3)."""
    octave = G**exponent
    edge = (G ** (1 / (2 * fraction)) - 1) / (G**0.5 - 1)
    return 1 + edge * (octave - 1)


@pytest.mark.parametrize("fraction", [1, 3])
@pytest.mark.parametrize(("exponent", "least", "most"), CLASS_1)
def test_bands_are_class_1(fraction, exponent, least, most):
    band = Band(1000.0, fraction)
    ratio = breakpoint_ratio(exponent, fraction)
    for frequency in (1000.0 * ratio, 1000.0 / ratio):
        attenuation = -10 * np.log10(band.power(np.array([frequency]))[0])
        assert least <= attenuation + 1e-9
        assert attenuation <= most


@pytest.mark.parametrize("fraction", [1, 3])
def test_adjacent_bands_add_up_to_the_whole(fraction):
    centers = 1000.0 * G ** (np.arange(-12, 13) / fraction)
    bands = bands_of(centers, fraction, zero_phase=False)
    inside = np.geomspace(centers[5], centers[-6], 500)
    total = sum(band.power(inside) for band in bands)
    np.testing.assert_allclose(10 * np.log10(total), 0.0, atol=0.35)


def test_spacing_tells_octaves_from_thirds():
    assert bands_of([125, 250, 500], None, zero_phase=False)[0].fraction == 1
    assert bands_of([100, 125, 160], None, zero_phase=False)[0].fraction == 3
    assert bands_of([1000], None, zero_phase=False)[0].fraction == 1


@pytest.mark.parametrize("centers", [[250, 1000, 4000], [315, 1000, 3150]])
def test_scores_well_on_decays_with_and_without_direct_sound(centers):
    cases = [BandCase(0.3), BandCase(1.0, -55.0, 5.0)]
    score = score_bands(band_parameters, centers, np.random.default_rng(0), cases)
    assert score.percent >= 97, score.remarks
    assert score.verdicts["wrong"] == score.verdicts["false"] == 0


def test_clarity_gates_before_it_filters():
    rng = np.random.default_rng(1)
    time = np.arange(RATE) / RATE
    wave = rng.standard_normal(RATE) * 10 ** (-3 * time / 0.8)
    wave[0] = 10.0
    band = bands_of([125], None, zero_phase=False)[0]
    found = band_parameters(wave, RATE, [125])
    truth = gated_clarity(wave, band, 0.05, RATE)
    np.testing.assert_allclose(found["C50"][0], truth, atol=0.15)


def test_short_decays_are_refused_where_the_filter_rings_longer():
    time = np.arange(RATE // 2) / RATE
    wave = np.random.default_rng(2).standard_normal(len(time)) * 10 ** (
        -3 * time / 0.05
    )
    found = band_parameters(wave, RATE, [63, 125, 8000])
    assert np.isnan(found["T30"][:2]).all()
    assert "short_BT" in found["flags"][0]
    np.testing.assert_allclose(found["T30"][2], 0.05, rtol=0.1)


def test_bands_beyond_half_the_rate_are_refused_not_raised():
    wave = np.random.default_rng(3).standard_normal(16000)
    wave *= 10 ** (-3 * np.arange(16000) / 16000 / 0.5)
    found = band_parameters(wave, 16000, [1000, 8000, 16000])
    assert np.isfinite(found["T20"][0])
    assert np.isnan(found["T20"][1:]).all()
    assert "half the sample rate" in found["reasons"][2]["T20"]


def test_last_axis_holds_the_bands():
    rng = np.random.default_rng(4)
    waves = rng.standard_normal((2, 3, RATE)) * 10 ** (
        -3 * np.arange(RATE) / RATE / 0.7
    )
    waves[1, 1] = 0.0
    found = band_parameters(waves, RATE, [500, 1000], zero_phase=True)
    assert found["T20"].shape == (2, 3, 2)
    assert found["flags"][1][1] == [["silent"], ["silent"]]
    np.testing.assert_allclose(found["T20"][0], 0.7, rtol=0.15)


def test_a_band_of_white_noise_agrees_with_the_full_band():
    rng = np.random.default_rng(5)
    waves = rng.standard_normal((8, RATE)) * 10 ** (-3 * np.arange(RATE) / RATE / 0.6)
    band = band_parameters(waves, RATE, [8000])
    full = acoustic_parameters(waves, RATE)
    for name in ("T20", "TS", "D50"):
        np.testing.assert_allclose(
            band[name][:, 0].mean(), full[name].mean(), rtol=0.02
        )


@pytest.mark.parametrize("centers", [[], [0.0], [np.nan], [-100]])
def test_no_band_is_refused(centers):
    with pytest.raises(SignalError):
        band_parameters(np.ones(1000), RATE, centers)
