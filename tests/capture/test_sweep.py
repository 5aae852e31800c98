"""The sweep and its harmonics."""

import pickle

import numpy as np
import pytest

from capture import synchronized_sweep
from rir.errors import SignalError


def test_the_sweep_is_synchronized_and_plain() -> None:
    sweep = synchronized_sweep(20, 20000, 3, 48000)
    assert sweep.dtype == np.float64
    count = sweep.f1 * sweep.rate
    np.testing.assert_allclose(count, round(count), atol=1e-9)
    t = np.arange(sweep.size) / 48000
    wanted = 0.5 * np.sin(2 * np.pi * count * np.expm1(t / sweep.rate))
    inner = slice(24000, 120000)
    np.testing.assert_allclose(np.asarray(sweep)[inner], wanted[inner], atol=1e-10)
    assert type(sweep[10:20]) is np.ndarray
    assert type(2 * sweep) is np.ndarray


def test_fades_stay_outside_the_band() -> None:
    sweep = synchronized_sweep(10, 22000, 2, 48000, band=(20, 20000))
    logs = np.log(np.array([20, 20000]) / sweep.f1)
    first, last = np.rint(sweep.rate * logs * 48000).astype(int)
    t = np.arange(sweep.size) / 48000
    wanted = 0.5 * np.sin(2 * np.pi * sweep.period_count * np.expm1(t / sweep.rate))
    inner = slice(first + 1, last - 1)
    np.testing.assert_allclose(np.asarray(sweep)[inner], wanted[inner], atol=1e-10)
    assert abs(sweep[0]) < 1e-12
    assert abs(sweep[-1]) < 1e-3


def test_it_survives_pickling() -> None:
    sweep = synchronized_sweep(20, 2000, 0.5, 8000)
    again = pickle.loads(pickle.dumps(sweep))
    np.testing.assert_array_equal(again, sweep)
    assert again.describe() == sweep.describe()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((20, 30000, 1, 48000), "cannot be made"),
        ((20, 2000, 0.001, 8000), "fewer than 64"),
    ],
)
def test_impossible_sweeps_are_refused(arguments: tuple, message: str) -> None:
    with pytest.raises(SignalError, match=message):
        synchronized_sweep(*arguments)
