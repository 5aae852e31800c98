"""Late energy between any two places: one map of position serves both ends.

    E(x, y, t) = exp(a(x) + a(y) - g0 t) max{least, 1 + sum_k u_k(x) u_k(y)
                 exp(-(g_k - g0) t)}

Energy that obeys reciprocity is a sum of modes which decay at common rates and
weigh both ends by the same function of position; a negative product u_k(x) u_k(y)
is energy that fades in, as behind a door. Rates come from
`inverse.late.slopes` and stay; the maps are fitted to log energies by damped
Gauss-Newton steps.
"""

from dataclasses import dataclass, replace

import numpy as np

from inverse.late.late_map_step import DerivativeSums, descend

__all__ = ["LateMaps", "chi_square_bias", "chi_square_variance", "fit_maps"]

RIDGE = 3.0  # on bumps: as much as three bins at which a place is like its region
FLAG_RIDGE = 0.1  # on regions' levels: only keeps rooms without a record finite
STIFF = 30.0
"""How much more the faster slopes' shares are held even within a region. A fade-in
is a few hundredths of the energy: only all pairs of two regions together tell it."""
LEAST_SUM = 0.02  # of the slowest slope's energy: a fade-in starts 17 dB below it
STEPS = 30  # at most; fits that converge stop before
CONVERGED = 1e-5  # relative change of the cost: far below what maps are known to


@dataclass(frozen=True, eq=False)
class LateMaps:
    """Hold the rates and maps of one band."""

    rates: np.ndarray
    """Shape (slopes,), 1/s, slowest first."""
    level: np.ndarray
    """Weights of the slowest slope's log amplitude, shape (features,), neper of
    energy."""
    shares: np.ndarray
    """Weights of the other slopes' relative amplitudes, shape (slopes - 1,
    features)."""

    def log_energies(
        self, first: np.ndarray, second: np.ndarray, times: np.ndarray
    ) -> np.ndarray:
        """Return log energies, shape (pairs, bins), of features of both ends."""
        return _modelled(self, first, second, times)[0]


def chi_square_bias(bandwidth: float, bin_s: float) -> float:
    """Return how far the mean log energy of a bin lies from the log of its mean.

    Parameters
    ----------
    bandwidth : float
        Hertz.
    bin_s : float
        Length of a bin, seconds.

    References
    ----------
    The energy of a bin has 2 B T degrees of freedom; the mean of the log of a
    chi-square variable over its mean is psi(n/2) - ln(n/2).
    """
    from scipy.special import digamma

    half = max(bandwidth * bin_s, 0.5)
    return float(digamma(half) - np.log(half))


def chi_square_variance(bandwidth: np.ndarray, bin_s: float) -> np.ndarray:
    """Return the variance of the log energy of a bin of noise, neper squared.

    Parameters
    ----------
    bandwidth : numpy.ndarray
        Hertz, any shape.
    bin_s : float
        Length of a bin, seconds.
    """
    from scipy.special import polygamma

    return np.asarray(polygamma(1, np.maximum(bandwidth * bin_s, 0.5)))


def fit_maps(
    log_energies: np.ndarray,
    times: np.ndarray,
    first: np.ndarray,
    second: np.ndarray,
    rates: np.ndarray,
    *,
    flags: int,
    floors: np.ndarray | None = None,
) -> LateMaps:
    """Fit the maps of one band with the rates as they are.

    Parameters
    ----------
    log_energies : numpy.ndarray
        Neper, shape (pairs, bins), corrected for :func:`chi_square_bias`; NaN
        where nothing was measured.
    times : numpy.ndarray
        Shape (bins,), seconds.
    first, second : numpy.ndarray
        Features of both ends, shape (pairs, features); the last `flags` columns
        are shares of regions and add up to one.
    rates : numpy.ndarray
        Shape (slopes,), 1/s, slowest first.
    flags : int
        Number of regions.
    floors : numpy.ndarray, optional
        Energy of the noise in a bin, shape (pairs,).
    """
    known = np.isfinite(log_energies)
    data = np.where(known, log_energies, 0.0)
    noise = np.zeros(len(data)) if floors is None else floors
    penalty = np.full(first.shape[1], RIDGE)
    penalty[len(penalty) - flags :] = FLAG_RIDGE
    pairs = _Pairs(data, known, times, first, second, noise, penalty)
    start = _one_slope(pairs, rates)
    best, best_cost = start, np.inf
    for shares in _starts(start, flags):
        fitted, cost = _refined(replace(start, shares=shares), pairs)
        if cost < best_cost:
            best, best_cost = fitted, cost
    return _opposed(best, np.vstack([first, second]), flags)


def _opposed(maps: LateMaps, places: np.ndarray, flags: int) -> LateMaps:
    """Return the maps with faster slopes opposed to the slowest in other regions.

    The slowest mode is positive everywhere, so that any other, orthogonal to it, has
    both signs. It is known well where it is strong; elsewhere its small share follows
    from the balance of u(x) exp(2 a(x)) over the regions, and with it the fade-in,
    which is less than a single pair's chance.
    """
    if flags < 2 or len(maps.shares) == 0:
        return maps
    held = places[:, places.shape[1] - flags :]
    count = np.maximum(held.sum(axis=0), 1e-9)
    energy = np.exp(np.clip(2 * (held.T @ (places @ maps.level)) / count, -600, 600))
    shares = maps.shares.copy()
    for one in shares:
        mean = held.T @ (places @ one) / count
        own = int(np.argmax(np.abs(mean)))
        others = np.arange(flags) != own
        share = -mean[own] * energy[own] / max(float(energy[others].sum()), 1e-300)
        if abs(share) < abs(mean[own]):
            one[len(one) - flags :][others] += share - mean[others]
    return replace(maps, shares=shares)


@dataclass(frozen=True, eq=False)
class _Pairs:
    """Hold log energies, which are known, and what holds the weights back."""

    data: np.ndarray
    known: np.ndarray
    times: np.ndarray
    first: np.ndarray
    second: np.ndarray
    noise: np.ndarray
    penalty: np.ndarray


def _one_slope(pairs: _Pairs, rates: np.ndarray) -> LateMaps:
    """Solve the linear problem of the slowest slope alone."""
    count = pairs.known.sum(axis=1)
    # Rows' mean levels are regressed around their common mean, so that the ridge
    # pulls towards an even field and not towards silence.
    rising = pairs.data + rates[0] * pairs.times
    level = np.where(pairs.known, rising, 0.0).sum(axis=1)
    total = max(int(count.sum()), 1)
    mean = float(level.sum()) / total
    both = pairs.first + pairs.second
    normal = (both * count[:, None]).T @ both + np.diag(pairs.penalty)
    right = both.T @ (level - mean * count)
    weights = np.linalg.solve(normal, right)
    flags = pairs.penalty == FLAG_RIDGE
    weights[flags] += 0.5 * mean
    empty = np.zeros((len(rates) - 1, len(weights)))
    return LateMaps(np.asarray(rates, dtype=float), weights, empty)


def _starts(start: LateMaps, flags: int) -> list[np.ndarray]:
    """Return first guesses of the shares: patterns over the regions."""
    slopes, features = start.shares.shape
    if slopes == 0:
        return [start.shares]
    patterns = [np.where(np.arange(flags) == k, 0.7, -0.7) for k in range(flags)]
    patterns.append(np.full(flags, 0.5))
    padded = [np.pad(one, (features - flags, 0)) for one in patterns]
    return [np.tile(one, (slopes, 1)) for one in padded]


def _waves(maps: LateMaps, times: np.ndarray) -> np.ndarray:
    """Return how the faster slopes fall against the slowest, shape (slopes, bins)."""
    return np.exp(-np.outer(maps.rates[1:] - maps.rates[0], times))


def _modelled(
    maps: LateMaps, first: np.ndarray, second: np.ndarray, times: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    level = (first @ maps.level + second @ maps.level)[:, None]
    waves = _waves(maps, times)
    products = (first @ maps.shares.T) * (second @ maps.shares.T)
    total = 1 + products @ waves
    held = np.maximum(total, LEAST_SUM)
    return level - maps.rates[0] * times + np.log(held), total


def _refined(maps: LateMaps, pairs: _Pairs) -> tuple[LateMaps, float]:
    """Descend with damping until the cost falls no more."""
    penalty, ends = pairs.penalty, (pairs.first, pairs.second)
    center = np.zeros_like(maps.level)
    flags = penalty == FLAG_RIDGE
    center[flags] = maps.level[flags].mean()
    damping, stiff = 1e-2, _stiffened(penalty)
    cost, moments = _measure(maps, pairs, center)
    for _ in range(STEPS):
        step_level, step_shares = descend(
            moments, ends, maps.shares, (penalty, stiff), damping
        )
        trial = replace(
            maps, level=maps.level + step_level, shares=maps.shares + step_shares
        )
        new, new_moments = _measure(trial, pairs, center)
        if new >= cost:
            damping *= 8
            if damping > 1e6:
                break
            continue
        converged = cost - new < CONVERGED * cost
        maps, cost, moments = trial, new, new_moments
        damping = max(damping / 4, 1e-7)
        if converged:
            break
    return maps, cost


def _stiffened(penalty: np.ndarray) -> np.ndarray:
    return np.where(penalty == FLAG_RIDGE, penalty, STIFF * penalty)


def _measure(
    maps: LateMaps, pairs: _Pairs, center: np.ndarray
) -> tuple[float, DerivativeSums]:
    """Return the cost and what a step needs of the residuals."""
    log, total = _modelled(maps, pairs.first, pairs.second, pairs.times)
    own = np.exp(log)
    energy = own + pairs.noise[:, None]
    gap = np.where(pairs.known, pairs.data - np.log(energy), 0.0)
    slope = np.where(pairs.known, own / energy, 0.0)
    waves = _waves(maps, pairs.times)
    pull = (maps.level - center) * pairs.penalty
    hold = maps.shares * _stiffened(pairs.penalty)
    cost = (gap**2).sum() + (pull * (maps.level - center)).sum()
    cost += (hold * maps.shares).sum()
    inverse = np.where(total > LEAST_SUM, 1 / np.maximum(total, LEAST_SUM), 0.0)
    parts = [slope] + [slope * inverse * wave for wave in waves]
    return float(cost), DerivativeSums.of(parts, gap, pull, hold)
