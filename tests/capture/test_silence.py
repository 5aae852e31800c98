import numpy as np

from capture.checks.silent_channels import longest_zeros, silent_channels

RATE = 16000


def test_a_pulled_cable_is_told_with_its_time() -> None:
    samples = np.random.default_rng(0).standard_normal((3, RATE))
    samples[1, 8000:] = 0.0
    [line] = silent_channels(samples, RATE, 1600, 14400)
    assert line.startswith("channel 1 is exactly zero for 0.40 s from 0.50 s on")


def test_short_and_early_silences_are_no_fault() -> None:
    samples = np.random.default_rng(0).standard_normal((1, RATE))
    samples[0, :3200] = 0.0
    samples[0, 9000:9200] = 0.0
    assert silent_channels(samples, RATE, 1600, 14400) == []


def test_all_zeros_are_one_run() -> None:
    assert longest_zeros(np.zeros(5)) == (0, 5)
    assert longest_zeros(np.ones(5))[1] == 0
