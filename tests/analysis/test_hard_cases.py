import warnings

import numpy as np
import pytest

from analysis import acoustic_parameters
from hard_cases import CASES, PARAMETERS, HardCase, judge_value, score_cases
from hard_cases.truth import exponential_truth, measured_truth

# "noise" holds pink noise at -35 dB, whose slow swings are inside the decay.
LEAST = {"noise": 99.0, "hard": 98.5, "random": 98.5}


@pytest.mark.parametrize("group", CASES)
def test_group_is_answered(group):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        score = score_cases(acoustic_parameters, CASES[group](np.random.default_rng(0)))
    assert score.values > 0
    assert score.percent >= LEAST.get(group, 99.4), score.remarks
    assert score.flagged >= 0.85 * score.due, score.remarks
    assert score.alarms == 0, score.remarks
    assert score.verdicts["crash"] == 0
    assert score.verdicts["false"] == 0


def test_truths_agree_with_each_other():
    rate, time = 48000, 0.8
    count = int(2.4 * time * rate)
    signs = np.random.default_rng(1).choice([-1.0, 1.0], count)
    wave = signs * 10 ** (-3 * np.arange(count) / rate / time)
    closed, measured = exponential_truth(time), measured_truth(wave, rate)
    for name, value in closed.items():
        np.testing.assert_allclose(measured[name], value, rtol=2e-3, atol=1e-3)


def test_a_guess_is_punished_and_silence_costs_nothing():
    case = HardCase("noise", np.ones(10), 48000, {"T30": float("nan"), "EDT": 1.0})

    def guess(_samples, _rate):
        return {name: np.float64(1.0) for name in PARAMETERS} | {"flags": []}

    def refuse(_samples, _rate):
        return {name: np.float64("nan") for name in PARAMETERS} | {"flags": []}

    def crash(_samples, _rate):
        raise RuntimeError("no")

    assert score_cases(guess, [case]).percent == 0.0
    assert score_cases(refuse, [case]).percent == 50.0
    assert score_cases(crash, [case]).percent == -100.0


@pytest.mark.parametrize(
    ("name", "truth", "value", "verdict"),
    [
        ("C50", 3.0, 3.05, "tight"),
        ("C50", 3.0, 3.9, "jnd"),
        ("C50", 3.0, 4.1, "wrong"),
        ("D50", 0.5, float("nan"), "missing"),
        ("TS", 0.2, 0.2019, "tight"),
        ("T20", float("nan"), float("nan"), "tight"),
    ],
)
def test_verdicts(name, truth, value, verdict):
    assert judge_value(name, truth, value, noisy=False, optional=False) == verdict
