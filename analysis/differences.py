"""Differences of responses by the paper's metrics, in one call."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.metrics import METRICS
from rir.errors import SignalError
from rir.response import as_samples, check_sample_rate

__all__ = ["PAPER_SYMBOLS", "compared_symbols", "paper_metrics"]

PAPER_SYMBOLS = ("Amp", "Env", "T60", "C50", "EDT", "STFT")
"""The metrics of the paper's tables, in their order."""


def compared_symbols(flavour: str) -> tuple[str, ...]:
    """Return the metrics of a report: the paper's, then those of other packages.

    A metric of another package is left out where it lacks the flavour.

    Examples
    --------
    >>> compared_symbols("paper")[:3]
    ('Amp', 'Env', 'T60')
    """
    more = (
        symbol
        for symbol, metric in METRICS.items()
        if symbol not in PAPER_SYMBOLS and flavour in metric.flavours
    )
    return (*PAPER_SYMBOLS, *more)


def paper_metrics(
    truth: ArrayLike,
    prediction: ArrayLike,
    sample_rate: float,
    flavour: str = "paper",
) -> dict[str, NDArray[np.float64]]:
    """Compare responses by the six metrics of the paper's tables.

    Parameters
    ----------
    truth, prediction : array_like, shape (..., n_samples)
        Responses of equal length; leading axes broadcast.
    sample_rate : float
        Samples per second [Hz].
    flavour : {"paper", "raf", "robust"}
        ``"paper"`` repeats the paper's code family exactly, absolute floors and
        all; ``"raf"`` that of Real Acoustic Fields; ``"robust"`` is ours: relative
        floors, counted from the direct sound, noise-aware, NaN where undetermined.

    Returns
    -------
    dict of str to ndarray, shape (...)
        Amp, Env, T60 (fractions; the paper prints Env and T60 in %), C50 [dB],
        EDT [s; the paper prints ms], STFT.

    Raises
    ------
    SignalError
        If the lengths differ, there is no sample, or the flavour is unknown.

    Examples
    --------
    >>> decay = np.exp(-np.arange(1600) / 300) * (-1.0) ** np.arange(1600)
    >>> round(float(paper_metrics(decay, 0.5 * decay, 16000)["Amp"]), 6)
    0.5
    """
    rate = check_sample_rate(sample_rate)
    first, second = as_samples(truth), as_samples(prediction)
    _check_shapes(first, second)
    return {
        symbol: METRICS[symbol].difference(first, second, rate, flavour)
        for symbol in PAPER_SYMBOLS
    }


def _check_shapes(truth: NDArray[np.float64], prediction: NDArray[np.float64]) -> None:
    if truth.ndim == 0 or prediction.ndim == 0 or 0 in truth.shape[-1:]:
        raise SignalError(
            f"responses need samples; got shapes {truth.shape} and {prediction.shape}"
        )
    if truth.shape[-1] != prediction.shape[-1]:
        raise SignalError(
            f"compare equal lengths only: {truth.shape[-1]} and "
            f"{prediction.shape[-1]} samples; crop both to the shorter"
        )
