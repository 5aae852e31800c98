"""One or two decays: the slopes of coupled rooms and uneven absorption."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.parameters import as_responses, check_rate
from rir.arrays import FloatArray

__all__ = ["Slopes", "fit_slopes"]

CLEAR_GAIN = 15.0
"""Gain in deviance, in units of its scatter, that a second slope must bring."""
LEAST_RATIO = 1.25
"""Two slopes nearer than this are one."""


@dataclass(frozen=True)
class Slopes:
    """Decays of responses, steepest first, by their initial levels."""

    times: FloatArray
    """Reverberation time of each decay [s]; NaN where there is none. Shape (..., 2)."""
    levels: FloatArray
    """Initial mean square of each decay re the sum of both [dB]. Shape (..., 2)."""
    noise: FloatArray
    """Mean square of the steady noise on the same scale [dB]. Shape (...)."""
    count: NDArray[np.int64]
    """0: no decay found; 1 or 2: slopes. Shape (...)."""


def fit_slopes(samples: ArrayLike, sample_rate: float) -> Slopes:
    """Fit one or two exponential decays and steady noise to responses.

    Block energies from the direct sound on are fitted by maximum likelihood; a
    second decay is taken only if it explains them clearly better and is at least a
    quarter longer.

    Parameters
    ----------
    samples : array_like, shape (..., n_samples)
        Responses, time last.
    sample_rate : float
        Samples per second [Hz].

    Returns
    -------
    Slopes

    Raises
    ------
    SignalError
        As `analysis.acoustic_parameters`.

    References
    ----------
    Xiang and Goggans, JASA 110 (2001) 1415: the model of several decays and noise.

    Examples
    --------
    >>> time = np.arange(96000) / 48000
    >>> wave = np.random.default_rng(0).choice([-1, 1], 96000)
    >>> power = 10 ** (-6 * time / 0.5) + 10 ** (-2 - 6 * time / 2.0)
    >>> found = fit_slopes(wave * np.sqrt(power), 48000)
    >>> int(found.count), found.times.round(2), found.levels.round()
    (2, array([0.5, 2. ]), array([ -0., -20.]))
    """
    rate = check_rate(sample_rate)
    responses = as_responses(samples)
    shape = responses.shape[:-1]
    rows = responses.reshape(-1, responses.shape[-1])
    energy = np.empty(rows.shape[-1])
    found = np.array([_fit_one(row, rate, energy) for row in rows])
    times, levels = found[:, :2], found[:, 2:4]
    return Slopes(
        times.reshape(*shape, 2),
        levels.reshape(*shape, 2),
        found[:, 4].reshape(shape),
        np.sum(np.isfinite(times), axis=-1).reshape(shape),
    )


def _fit_one(samples: FloatArray, rate: float, energy: FloatArray) -> FloatArray:
    """Return two times, two levels and the noise level of a response."""
    from analysis.decay.answer import Answers
    from analysis.decay.response import find_decay, prepare
    from analysis.decay.scan import locate

    nothing, answer = np.full(5, np.nan), Answers.empty(1).row(0)
    if prepare(samples, energy, answer) is None:
        return nothing
    onset, stop, _pulses = locate(energy)
    _onset, fit = find_decay(energy, onset, stop, rate, answer)
    if not fit.decays:
        return nothing
    theta = _best_model(fit.means[: fit.count], fit.theta, fit.width)
    rates = np.exp(theta[[2, 4]])
    with np.errstate(divide="ignore"):
        times = np.where(
            rates > 0.0, 6.0 * np.log(10.0) * fit.width / rate / rates, np.nan
        )
    levels = 10.0 / np.log(10.0) * (theta[[1, 3, 0]] - np.logaddexp(theta[1], theta[3]))
    levels[:2][np.isnan(times)] = np.nan
    order = np.argsort(times)
    return np.concatenate([times[order], levels[:2][order], levels[2:]])


def _best_model(means: FloatArray, start: FloatArray, width: int) -> FloatArray:
    """Return the logarithms of one or two decays and noise that fit the blocks."""
    from analysis.decay.model import improve

    used, count = np.ones(len(means), dtype=np.bool_), len(means)
    noisy = int(start[0] == -np.inf)
    single = start.copy()
    if single[3] > -np.inf:
        single[1:3], single[3:] = start[3:], -np.inf
    late = single.copy()
    one = improve(single, means, used, 1, count, np.arange(noisy, 3))
    best, chosen = math.inf, single
    for ratio in (1.5, 2.5, 5.0):
        double = late.copy()
        double[3:] = late[1:3]
        double[2] = late[2] + math.log(ratio)
        double[1] = math.log(means[1] + 1e-300) + 1.5 * math.exp(double[2])
        value = improve(double, means, used, 1, count, np.arange(noisy, 5))
        if value < best:
            best, chosen = value, double
    scatter = _scatter(chosen, means, width)
    apart = abs(chosen[2] - chosen[4]) > math.log(LEAST_RATIO)
    heard = np.exp(chosen[[2, 4]]).min() * count > 0.7
    return chosen if apart and heard and best < one - CLEAR_GAIN * scatter else single


def _scatter(theta: FloatArray, means: FloatArray, width: int) -> float:
    """Return the variance of the relative residuals, robustly."""
    times = np.arange(len(means)) + 0.5
    model = np.exp(theta[0]) + sum(
        np.exp(theta[k] - np.exp(theta[k + 1]) * times) for k in (1, 3)
    )
    residual = np.abs(means / model - 1.0)[1:]
    return max((1.4826 * float(np.median(residual))) ** 2, 2.0 / width)
