"""Threads change no answer."""

import numpy as np
import pytest

from analysis import acoustic_parameters, band_parameters
from rir.errors import SignalError


@pytest.fixture(scope="module")
def batch():
    rng = np.random.default_rng(0)
    times = rng.uniform(0.2, 0.8, (13, 1))
    decay = 10 ** (-3 * np.arange(16000) / 16000 / times)
    waves = rng.standard_normal(decay.shape) * decay
    return waves + 1e-3 * rng.standard_normal(decay.shape)


def assert_same(one, two):
    assert one["flags"] == two["flags"]
    assert one["reasons"] == two["reasons"]
    for name in ("EDT", "T20", "T30", "C50", "C80", "DRR", "D50", "TS"):
        np.testing.assert_array_equal(one[name], two[name])


@pytest.mark.parametrize("threads", [2, 3])
def test_answers_are_bit_identical(batch, threads):
    assert_same(
        acoustic_parameters(batch, 16000),
        acoustic_parameters(batch, 16000, threads=threads),
    )
    assert_same(
        band_parameters(batch, 16000, [500, 1000]),
        band_parameters(batch, 16000, [500, 1000], threads=threads),
    )


def test_no_threads_are_refused(batch):
    with pytest.raises(SignalError, match="at least 1"):
        acoustic_parameters(batch, 16000, threads=0)
