"""The flavours of Real Acoustic Fields, and ours."""

import numpy as np
import pytest

from analysis import METRICS, paper_metrics
from analysis.metrics.reverberation import high_passed, raf_reverberation_time

RATE = 48000


def decay(reverberation_time, seed=0, count=RATE):
    sign = np.random.default_rng(seed).choice([-1.0, 1.0], count)
    return sign * 10 ** (-3 * np.arange(count) / RATE / reverberation_time)


def test_reverberation_time_agrees_with_pyroomacoustics():
    # Its fit between the same two points changed with version 0.7.5.
    pra = pytest.importorskip("pyroomacoustics")
    for seed, time in enumerate((0.2, 0.5, 0.9)):
        h = decay(time, seed)
        filtered = high_passed(h, RATE)
        expected = pra.experimental.measure_rt60(filtered, RATE, decay_db=10)
        got = raf_reverberation_time(h, RATE)[0]
        np.testing.assert_allclose(got, expected, rtol=1e-3)
        np.testing.assert_allclose(got, time, rtol=5e-3)


def test_high_pass_has_its_corner_at_200_hz():
    pulse = np.eye(1, 1 << 15)[0]
    gain = np.abs(np.fft.rfft(high_passed(pulse, RATE)))
    frequency = np.fft.rfftfreq(1 << 15, 1 / RATE)
    at = [int(np.argmin(np.abs(frequency - f))) for f in (20.5, 200, 2000)]
    np.testing.assert_allclose(20 * np.log10(gain[at]), [-39.57, -3.01, 0], atol=0.05)


def test_invalid_reverberation_time_counts_as_one():
    h = decay(0.5)
    assert paper_metrics(h, 0 * h, RATE, "raf")["T60"] == 1.0
    assert np.isnan(paper_metrics(h, 0 * h, RATE, "raf")["EDT"])


def test_clarity_splits_one_sample_later():
    h = np.ones(RATE)
    expected = 10 * np.log10(2401 / (RATE - 2401))
    got = paper_metrics(h, decay(0.5), RATE, "raf")["C50"]
    other = 10 * np.log10(
        np.sum(decay(0.5)[:2401] ** 2) / np.sum(decay(0.5)[2401:] ** 2)
    )
    np.testing.assert_allclose(got, abs(expected - other))


def test_spectrogram_of_a_gain_error_is_its_logarithm():
    h = 100 * decay(0.9, 3)
    got = paper_metrics(h, 2 * h, RATE, "raf")["STFT"]
    np.testing.assert_allclose(got, np.log(2), rtol=0.01)


@pytest.mark.parametrize("symbol", list(METRICS))
def test_robust_flavour_does_not_depend_on_the_level(symbol):
    rng = np.random.default_rng(4)
    a, b = (decay(0.4, k) + 1e-4 * rng.standard_normal(RATE) for k in range(2))
    loud = METRICS[symbol].difference(a, b, RATE, "robust")
    quiet = METRICS[symbol].difference(1e-6 * a, 1e-6 * b, RATE, "robust")
    np.testing.assert_allclose(quiet, loud, rtol=1e-9)


def test_robust_times_do_not_count_the_flight():
    h = decay(0.4)
    late = np.r_[np.zeros(2000), h[:-2000]]
    got = paper_metrics(h, late, RATE, "robust")
    for symbol in ("T60", "EDT", "C50"):
        np.testing.assert_allclose(got[symbol], 0, atol=0.01)
    assert paper_metrics(h, late, RATE)["EDT"] > 0.2


def test_robust_value_of_noise_is_undetermined():
    noise = np.random.default_rng(0).standard_normal(RATE)
    assert np.isnan(paper_metrics(decay(0.4), noise, RATE, "robust")["T60"])
