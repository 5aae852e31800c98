import numpy as np
import pytest

from analysis import acoustic_parameters
from hard_cases import PARAMETERS
from rir.errors import SignalError

RATE = 48000


def decay_of(time, seconds=1.5, rate=RATE, seed=0):
    """Return a decay whose energy envelope is exact: random signs."""
    count = int(seconds * rate)
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], count)
    return signs * 10 ** (-3 * np.arange(count) / rate / time)


@pytest.mark.parametrize("time", [0.1, 0.5, 2.0])
def test_endless_exponential_has_its_closed_forms(time):
    found = acoustic_parameters(decay_of(time, 2.2 * time), RATE)
    for name in ("EDT", "T20", "T30"):
        np.testing.assert_allclose(found[name], time, rtol=2e-3)
    ratio = 10 ** (6 * 0.05 / time)
    np.testing.assert_allclose(found["C50"], 10 * np.log10(ratio - 1), atol=0.02)
    np.testing.assert_allclose(found["D50"], 1 - 1 / ratio, atol=1e-3)
    np.testing.assert_allclose(found["TS"], time / (6 * np.log(10)), rtol=2e-3)
    assert found["flags"] == []
    assert found["reasons"] == {}


@pytest.mark.parametrize("floor_db", [-60, -50, -40])
def test_noise_leaves_no_bias(floor_db):
    rng = np.random.default_rng(1)
    clean = np.array([decay_of(0.8, 2.0, seed=k) for k in range(12)])
    noisy = clean + 10 ** (floor_db / 20) * rng.standard_normal(clean.shape)
    found = acoustic_parameters(noisy, RATE)
    np.testing.assert_allclose(np.mean(found["T30"]), 0.8, rtol=5e-3)
    np.testing.assert_allclose(np.mean(found["C80"]), 4.743, atol=0.05)
    np.testing.assert_allclose(found.range_available, -floor_db, atol=1.5)


def test_direct_sound_sets_the_direct_to_reverberant_ratio():
    tail = decay_of(1.0)
    tail[0] = np.sqrt(np.sum(tail[121:] ** 2) * 10**0.6)
    found = acoustic_parameters(tail, RATE)
    window = np.sum(tail[:121] ** 2)
    np.testing.assert_allclose(
        found["DRR"], 10 * np.log10(window / np.sum(tail[121:] ** 2)), atol=0.02
    )


def test_two_impulses_have_ratios_but_no_times():
    pulses = np.zeros(RATE)
    pulses[[0, 4800]] = 1.0, 0.5
    found = acoustic_parameters(pulses, RATE)
    np.testing.assert_allclose(found["C50"], 20 * np.log10(2))
    np.testing.assert_allclose(found["D50"], 0.8)
    np.testing.assert_allclose(found["TS"], 0.02)
    assert np.isnan([found["EDT"], found["T20"], found["T30"]]).all()
    assert "single steps" in found["reasons"]["T30"]


def test_a_range_that_is_not_there_is_refused_with_its_reason():
    cut = decay_of(1.0, 25 / 60)
    found = acoustic_parameters(cut, RATE)
    assert np.isnan(found["T30"])
    assert "too early" in found["reasons"]["T30"]
    assert "low_dynamic_range" in found["flags"]
    np.testing.assert_allclose(found["EDT"], 1.0, rtol=0.01)


def test_values_do_not_depend_on_scale_sign_or_type():
    wave = decay_of(0.6)
    reference = acoustic_parameters(wave, RATE)
    for other in (wave * 1e-160, -wave * 1e200, np.asarray(wave, dtype=np.float32)):
        found = acoustic_parameters(other, RATE)
        for name in ("EDT", "T20", "T30", "C50", "TS"):
            np.testing.assert_allclose(found[name], reference[name], rtol=1e-4)


def test_leading_axes_are_kept_and_rows_are_independent():
    rows = np.stack([decay_of(t, 2.0) for t in (0.4, 0.8, 1.2, 0.6)]).reshape(2, 2, -1)
    rows[1, 0] = 0.0
    found = acoustic_parameters(rows, RATE)
    assert found["T20"].shape == (2, 2)
    np.testing.assert_allclose(found["T20"][0], [0.4, 0.8], rtol=2e-3)
    assert np.isnan(found["T20"][1, 0])
    assert found["flags"][1] == [["silent"], []]
    assert found["reasons"][1][0]["C50"] == "every sample is zero"


@pytest.mark.parametrize(
    ("samples", "rate"),
    [
        (np.zeros(0), 48000),
        (np.zeros((3, 0)), 48000),
        (np.float64(1.0), 48000),
        (np.zeros((48000, 2)), 48000),
        (np.array(["a"]), 48000),
        (np.ones(100) * 1j, 48000),
        (np.ones(100), -48000),
        (np.ones(100), np.nan),
    ],
)
def test_what_is_no_response_is_refused(samples, rate):
    with pytest.raises(SignalError):
        acoustic_parameters(samples, rate)


def test_flags_name_what_is_wrong():
    rng = np.random.default_rng(2)
    noisy = decay_of(0.8, 2.5) + 1e-3 * rng.standard_normal(int(2.5 * RATE))
    clipped = np.clip(noisy, -0.8, 0.8)
    shifted = noisy + 0.01
    broken = noisy.copy()
    broken[100] = np.nan
    clicked = noisy.copy()
    clicked[int(1.2 * RATE)] += 0.3
    early = np.concatenate([1e-3 * rng.standard_normal(9600), noisy])
    early[5000] = 0.25
    for wave, word in (
        (clipped, "clipped"),
        (shifted, "dc_offset"),
        (broken, "non_finite"),
        (clicked, "tail_event"),
        (early, "early_click"),
    ):
        assert word in acoustic_parameters(wave, RATE)["flags"]
    np.testing.assert_allclose(
        acoustic_parameters(clicked, RATE)["T30"], 0.8, rtol=0.01
    )
    np.testing.assert_allclose(acoustic_parameters(early, RATE)["C50"], 1.37, atol=0.1)


def test_uncertainty_is_the_scatter_of_realisations():
    rng = np.random.default_rng(3)
    rate, time = 4000, 0.5
    count = int(1.2 * rate)
    envelope = 10 ** (-3 * np.arange(count) / rate / time)
    waves = rng.standard_normal((600, count)) * envelope
    found = acoustic_parameters(waves, rate)
    for name in ("EDT", "T20", "T30", "C50", "D50"):
        np.testing.assert_allclose(
            np.std(found[name]), np.mean(found.uncertainty[name]), rtol=0.15
        )


def test_curvature_and_nonlinearity_show_two_slopes():
    time = np.arange(2 * RATE) / RATE
    power = 10 ** (-6 * time / 0.4) + 10 ** (-1.8 - 6 * time / 1.6)
    signs = np.random.default_rng(4).choice([-1.0, 1.0], len(time))
    bent = acoustic_parameters(signs * np.sqrt(power), RATE)
    straight = acoustic_parameters(decay_of(0.4), RATE)
    assert bent.curvature > 10
    assert "curved_decay" in bent["flags"]
    assert bent.nonlinearity["T30"] > 10 > 0.1 > straight.nonlinearity["T30"]
    np.testing.assert_allclose(straight.curvature, 0.0, atol=0.2)


def test_the_answer_is_a_plain_dict():
    found = acoustic_parameters(decay_of(0.3), RATE)
    assert dict(found).keys() == {*PARAMETERS, "flags", "reasons"}
    assert isinstance(found, dict)
