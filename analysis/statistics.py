"""Means over pairs with intervals that hold for twenty skewed values."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray

__all__ = [
    "Estimate",
    "estimate_mean",
    "interval_of_pseudo_values",
    "ratio_of_means",
    "superiority",
]

Groups = NDArray[np.intp]
RESAMPLES = 4000
"""A hundred of them lie beyond each end of an interval."""


@dataclass(frozen=True)
class Estimate:
    """A mean with its spread and a 95 % interval.

    Parameters
    ----------
    mean, deviation, median : float
        Mean, standard deviation and median of the values that are defined.
    low, high : float
        Ends of the 95 % interval of the mean; NaN with fewer than three pairs.
    count : int
        Values that are defined.
    undefined : int
        Values that are not.
    """

    mean: float
    deviation: float
    median: float
    low: float
    high: float
    count: int
    undefined: int


def interval_of_pseudo_values(
    values: FloatArray,
    rng: np.random.Generator,
    level: float = 0.95,
    *,
    positive: bool = False,
) -> tuple[float, float]:
    """Return the studentised bootstrap interval of a mean over pairs.

    Parameters
    ----------
    values : ndarray, shape (n_pairs,)
        One value, or jackknife pseudo-value of a statistic, for each pair.
    rng : numpy.random.Generator
        Draws the resamples.
    level : float
        Coverage asked for.
    positive : bool
        Whether the mean is of distances: the interval is then found on its
        logarithm and stays above zero.

    References
    ----------
    Efron and Tibshirani, An Introduction to the Bootstrap (1993), section 12.5:
    the percentile interval covers too seldom for twenty skewed values, the
    studentised one keeps its level.

    Examples
    --------
    >>> low, high = interval_of_pseudo_values(
    ...     np.arange(20.0), np.random.default_rng(0))
    >>> low < 9.5 < high
    True
    """
    kept = values[np.isfinite(values)]
    count = len(kept)
    if count < 3:
        return np.nan, np.nan
    error = kept.std(ddof=1) / np.sqrt(count)
    if error <= 1e-12 * abs(kept.mean()):
        return float(kept.mean()), float(kept.mean())
    draws = kept[rng.integers(0, count, (RESAMPLES, count))]
    errors = draws.std(axis=1, ddof=1) / np.sqrt(count)
    # Resamples that miss the one large value say nothing of the spread.
    usable = errors > 0.1 * error
    means, mean = draws[usable].mean(axis=1), kept.mean()
    tails = [(1 + level) / 2, (1 - level) / 2]
    if positive and mean > 0 and np.all(means > 0):
        ratios = np.log(means / mean) * means / errors[usable]
        low, high = mean * np.exp(-np.quantile(ratios, tails) * error / mean)
        return _with_long_tail(kept, float(low), float(high), level)
    ratios = (means - mean) / errors[usable]
    low, high = mean - np.quantile(ratios, tails) * error
    return float(low), float(high)


def _with_long_tail(
    values: FloatArray, low: float, high: float, level: float
) -> tuple[float, float]:
    """Raise the upper end of a mean's interval where values spread log-normally.

    Twenty values seldom hold the large ones that a long tail's mean rests on, and
    resampling cannot find what is not there. Cox's interval supplies them by the
    shape of the logarithms; it is left out where these lean to the small side, as
    those of values that come near zero do.

    References
    ----------
    Zhou and Gao, Statistics in Medicine 16 (1997) 783: Cox's interval, with Student's
    quantile for the normal one.
    """
    count = len(values)
    if np.any(values <= 0.0):
        return low, high
    logs = np.log(values)
    if skewness(logs) < -0.4 - 7.0 / count:
        return low, high
    variance = float(logs.var(ddof=1))
    error = np.sqrt(variance / count + variance**2 / (2.0 * (count - 1)))
    from scipy.special import stdtrit

    reach = float(stdtrit(count - 1, (1.0 + level) / 2.0)) * error
    centre = logs.mean() + variance / 2.0
    return low, max(high, float(np.exp(centre + reach)))


def skewness(values: FloatArray) -> float:
    """Return the adjusted third standardised moment of a sample.

    Examples
    --------
    >>> round(skewness(np.array([0.0, 1.0, 2.0])), 12)
    0.0
    """
    count, away = len(values), values - values.mean()
    variance = np.mean(away**2)
    if variance <= 0.0 or count < 3:
        return 0.0
    moment = np.mean(away**3) / variance**1.5
    return float(moment * np.sqrt(count * (count - 1.0)) / (count - 2.0))


def estimate_mean(
    values: FloatArray, groups: Groups, rng: np.random.Generator
) -> Estimate:
    """Estimate the mean of values that share pairs.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Distances.
    groups : ndarray of int, shape (n, k)
        The pairs each distance was made of; the pairs are the independent units.
    rng : numpy.random.Generator
        Draws the resamples.
    """
    good = np.isfinite(values)
    kept = values[good]
    if not len(kept):
        return Estimate(np.nan, np.nan, np.nan, np.nan, np.nan, 0, len(values))
    low, high = interval_of_pseudo_values(
        pseudo_values(kept, np.asarray(groups)[good]), rng, positive=True
    )
    return Estimate(
        mean=float(kept.mean()),
        deviation=float(kept.std(ddof=1)) if len(kept) > 1 else np.nan,
        median=float(np.median(kept)),
        low=low,
        high=high,
        count=len(kept),
        undefined=int(np.sum(~good)),
    )


def pseudo_values(values: FloatArray, groups: Groups) -> FloatArray:
    """Return the jackknife pseudo-values of the mean, one for each pair.

    References
    ----------
    Efron and Tibshirani (1993), equation (11.13): n theta - (n - 1) theta_(-i).
    """
    members = np.unique(groups)
    count = len(members)
    total, number = values.sum(), len(values)
    result = np.full(count, np.nan)
    for k, member in enumerate(members):
        inside = np.any(groups == member, axis=-1)
        rest = number - inside.sum()
        if rest > 0:
            without = (total - values[inside].sum()) / rest
            result[k] = count * values.mean() - (count - 1) * without
    return result


def ratio_of_means(
    paired: FloatArray,
    own: Groups,
    unpaired: FloatArray,
    strangers: Groups,
    rng: np.random.Generator,
) -> tuple[float, float]:
    """Return the 95 % interval of mean(unpaired) / mean(paired).

    The intervals of both means are put together on the logarithm, with the
    correlation that the jackknife over pairs finds between them.

    References
    ----------
    Zou and Donner, Statistics in Medicine 27 (2008) 1693: recovery of variances.
    """
    first, second = np.isfinite(paired), np.isfinite(unpaired)
    if first.sum() < 3 or not second.any():
        return np.nan, np.nan
    small = estimate_mean(paired[first], own[first], rng)
    large = estimate_mean(unpaired[second], strangers[second], rng)
    if not min(small.mean, large.mean, small.low, large.low) > 0:
        return np.nan, np.nan
    shared = _correlation(
        paired[first], own[first], unpaired[second], strangers[second]
    )
    ends = np.log([small.low, small.high, large.low, large.high])
    below, above = np.log(small.mean) - ends[0], ends[1] - np.log(small.mean)
    under, over = np.log(large.mean) - ends[2], ends[3] - np.log(large.mean)
    ratio = np.log(large.mean / small.mean)
    low = ratio - np.sqrt(under**2 + above**2 - 2.0 * shared * under * above)
    high = ratio + np.sqrt(over**2 + below**2 - 2.0 * shared * over * below)
    return float(np.exp(low)), float(np.exp(high))


def _correlation(
    paired: FloatArray, own: Groups, unpaired: FloatArray, strangers: Groups
) -> float:
    """Return the correlation of both means, by leaving out one pair at a time."""
    members = np.intersect1d(own, strangers)
    parts = [
        dict(
            zip(np.unique(groups).tolist(), pseudo_values(values, groups), strict=True)
        )
        for values, groups in ((paired, own), (unpaired, strangers))
    ]
    both = np.array([[part[k] for part in parts] for k in members.tolist()])
    both = both[np.all(np.isfinite(both), axis=-1)] if len(both) else both
    if len(both) < 3 or np.any(np.ptp(both, axis=0) <= 0.0):
        return 0.0
    return float(np.corrcoef(both.T)[0, 1])


def superiority(small: FloatArray, large: FloatArray) -> float:
    """Return the chance that a value of `large` exceeds one of `small`.

    1 means that every un-paired distance exceeds every paired one, 0.5 that the
    two do not differ.

    References
    ----------
    Vargha and Delaney, J. Educ. Behav. Stat. 25 (2000) 101, the measure A.

    Examples
    --------
    >>> superiority(np.array([1.0, 2.0]), np.array([2.0, 3.0]))
    0.875
    """
    low, high = small[np.isfinite(small)], np.sort(large[np.isfinite(large)])
    if not len(low) or not len(high):
        return float("nan")
    below = np.searchsorted(high, low, "left")
    ties = np.searchsorted(high, low, "right") - below
    wins = len(high) * len(low) - below.sum() - ties.sum() / 2
    return float(wins / (len(high) * len(low)))
