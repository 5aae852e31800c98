"""The paper's flavour against independent references."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from analysis import METRICS, paper_metrics
from analysis.conformance import check_metric
from rir.errors import SignalError, UnknownNameError

RATE = 16000


def decaying_noise(rng, reverberation_time=0.2, count=1600, rate=RATE):
    time = np.arange(count) / rate
    return rng.standard_normal(count) * 10 ** (-3 * time / reverberation_time)


def test_sanity_values_of_known_errors():
    rng = np.random.default_rng(0)
    h, other = decaying_noise(rng), decaying_noise(rng)
    half = paper_metrics(h, 0.5 * h, RATE)
    np.testing.assert_allclose(half["Amp"], 0.5, rtol=1e-12)
    np.testing.assert_allclose(half["Env"], 0.073, atol=0.0005)
    nothing = paper_metrics(h, 0 * h, RATE)
    np.testing.assert_allclose(nothing["Amp"], 1.0, rtol=1e-12)
    np.testing.assert_allclose(nothing["Env"], 0.147, atol=0.0005)
    stranger = paper_metrics(h, other, RATE)
    np.testing.assert_allclose(stranger["Amp"], 0.20, atol=0.03)
    np.testing.assert_allclose(stranger["Env"], 0.086, atol=0.002)
    np.testing.assert_allclose(stranger["STFT"], 2.6, atol=0.1)
    late = paper_metrics(h, np.r_[np.zeros(16), h[:-16]], RATE)
    np.testing.assert_allclose(late["Amp"], 0.001, atol=0.0005)
    np.testing.assert_allclose(late["Env"], 0.087, atol=0.002)


def test_stft_equals_auraloss():
    auraloss = pytest.importorskip("auraloss")
    import torch

    loss = auraloss.freq.MultiResolutionSTFTLoss(
        fft_sizes=[512, 256, 128],
        win_lengths=[300, 150, 75],
        hop_sizes=[60, 30, 8],
        w_sc=1.0,
        w_log_mag=1.0,
        w_lin_mag=1.0,
    )
    rng = np.random.default_rng(2)
    for scale in (1.0, 1e-2, 1e-4):
        truth, prediction = (scale * decaying_noise(rng) for _ in range(2))
        tensors = [torch.from_numpy(x)[None, None] for x in (truth, prediction)]
        loss = loss.double()
        for term in loss.stft_losses:
            term.window = term.window.double()
        expected = float(loss(*tensors))
        ours = paper_metrics(truth, prediction, RATE)["STFT"]
        np.testing.assert_allclose(ours, expected, rtol=1e-6)


def test_envelope_equals_scipy_hilbert():
    from scipy.signal import hilbert

    rng = np.random.default_rng(3)
    for count in (1600, 1601):
        a, b = (decaying_noise(rng, count=count) for _ in range(2))
        envelopes = [np.abs(np.asarray(hilbert(x))) for x in (a, b)]
        expected = np.mean(np.abs(envelopes[0] - envelopes[1])) / envelopes[0].max()
        np.testing.assert_allclose(paper_metrics(a, b, RATE)["Env"], expected)


def test_exponential_decays_have_closed_form_differences():
    time = np.arange(4 * RATE) / RATE
    sign = np.random.default_rng(4).choice([-1.0, 1.0], len(time))
    slow, fast = (sign * 10 ** (-3 * time / t) for t in (0.5, 0.4))
    got = paper_metrics(slow, fast, RATE)
    np.testing.assert_allclose(got["T60"], 0.2, atol=2e-3)
    np.testing.assert_allclose(got["EDT"], 0.1, atol=6 / RATE)
    clarity = [10 * np.log10(10 ** (6 * 0.05 / t) - 1) for t in (0.5, 0.4)]
    np.testing.assert_allclose(got["C50"], clarity[1] - clarity[0], atol=1e-6)


def test_paper_floor_makes_the_result_depend_on_level():
    time = np.arange(RATE) / RATE
    sign = np.random.default_rng(5).choice([-1.0, 1.0], len(time))
    h = sign * 10 ** (-3 * time / 0.2)
    assert paper_metrics(h, 1e-3 * h, RATE)["T60"] > 1.0


def test_leading_axes_broadcast_and_agree_with_single_rows():
    rng = np.random.default_rng(6)
    truth = np.stack([decaying_noise(rng) for _ in range(3)])[:, None]
    prediction = np.stack([decaying_noise(rng) for _ in range(2)])
    for symbol, values in paper_metrics(truth, prediction, RATE).items():
        assert values.shape == (3, 2), symbol
        single = paper_metrics(truth[1, 0], prediction[1], RATE)[symbol]
        np.testing.assert_allclose(values[1, 1], single, rtol=1e-12)


def test_undefined_differences_are_not_finite_and_raise_no_warning():
    silence, pulse = np.zeros(1600), np.eye(1, 1600)[0]
    assert np.isinf(paper_metrics(silence, pulse, RATE)["Amp"])
    assert np.isnan(paper_metrics(silence, silence, RATE)["Amp"])
    assert np.isnan(paper_metrics(silence, silence, RATE)["C50"])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((np.ones(5), np.ones(6), RATE), "equal lengths"),
        ((np.ones(0), np.ones(0), RATE), "need samples"),
        ((np.ones(5), np.ones(5), -1), "positive"),
        ((np.ones(5), np.ones(5), RATE, "avr"), "known: paper"),
    ],
)
def test_wrong_input_is_explained(arguments, words):
    with pytest.raises(SignalError, match=words):
        paper_metrics(*arguments)


@pytest.mark.parametrize("symbol", list(METRICS))
def test_every_metric_conforms(symbol):
    check_metric(symbol)


def test_every_metric_file_is_in_the_table():
    folder = Path(str(files("analysis.metrics")))
    entering = [p for p in folder.glob("*.py") if " = Metric(\n" in p.read_text()]
    assert len(entering) == len(METRICS)


def test_unknown_metric_names_the_known_ones():
    with pytest.raises(UnknownNameError, match="C50"):
        METRICS["C5O"]
