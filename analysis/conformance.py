"""What every metric promises; run it on your own by its symbol."""

import numpy as np
from numpy.typing import NDArray

from analysis.metrics import METRICS
from rir.conformance import promise

__all__ = ["check_metric"]

RATE = 16000
"""Of the example responses, Hz: a rate the paper's data have."""
COUNT = 4800
"""Samples of an example response: 0.3 s of a decay of 0.2 s."""


def check_metric(symbol: str) -> None:
    """Check that a metric of the table is a distance, in each of its flavours.

    Parameters
    ----------
    symbol : str
        Name in the table of metrics.

    Raises
    ------
    AssertionError
        If a promise is broken; names it.
    """
    metric = METRICS[symbol]
    promise(metric.symbol == symbol, f"{symbol} calls itself as the table does")
    rng = np.random.default_rng(7)
    a, b = (_decaying_noise(rng, rows=3) for _ in range(2))
    for name, flavour in metric.flavours.items():
        where = f"{symbol}, flavour {name}"
        promise(flavour.version.startswith(name), f"{where}: the version names it")
        promise(flavour.source, f"{where}: a source is given")
        same = metric.difference(a, a, RATE, name)
        np.testing.assert_allclose(
            same,
            np.zeros(3),
            atol=1e-12,
            err_msg=f"{where}: differs from itself",
        )
        there = metric.difference(a, b, RATE, name)
        back = metric.difference(b, a, RATE, name)
        promise(there.shape == (3,), f"{where}: one number for each response")
        known = np.isfinite(there)
        promise(np.all(there[known] > 0), f"{where}: unlike responses differ")
        if metric.symmetric:
            np.testing.assert_allclose(
                there, back, rtol=1e-12, err_msg=f"{where}: said to be symmetric"
            )
        if flavour.matrix is not None:
            described = flavour.describe(a, RATE)
            one_by_one = [
                flavour.compare(tuple(part[k] for part in described), described)
                for k in range(len(a))
            ]
            np.testing.assert_allclose(
                flavour.matrix(described),
                one_by_one,
                rtol=1e-9,
                err_msg=f"{where}: all at once is the same as one by one",
            )


def _decaying_noise(rng: np.random.Generator, rows: int) -> NDArray[np.float64]:
    time = np.arange(COUNT) / RATE
    return rng.standard_normal((rows, COUNT)) * 10 ** (-3 * time / 0.2)
