"""Common decay rates: found once from all pairs together, then kept.

Every pair may have amplitudes of its own, of either sign; only the rates are
shared. For given rates the amplitudes are linear and drop out (variable
projection), so that rates are found on a grid and cannot run away.
"""

import numpy as np

__all__ = ["LEAST_RATIO", "common_rates", "region_curves"]

LEAST_RATIO = 1.5  # of two rates; closer ones add up to nearly one decay
GRID = 36  # rates 15 to 20 % apart over what a tail can hold; finer ones follow
FINE = 9  # rates of each finer grid, a quarter of the step before apart
FAST_RANGES = 9  # four rates each: every range has a fast rate of its own
PASSES = 2  # the second weighs by what the first found instead of a parabola
WORTH = 2.0  # gain a pair in units of chance: Akaike's price of one number more
EXACT = 1e-4  # relative misfit that a grid of rates leaves even of exact decays


def common_rates(
    energies: np.ndarray, times: np.ndarray, *, most: int = 2
) -> np.ndarray:
    """Return the decay rates that all pairs share, slowest first.

    Parameters
    ----------
    energies : numpy.ndarray
        Energy of each pair and time bin, shape (pairs, bins), positive.
    times : numpy.ndarray
        Middle of each bin, shape (bins,), seconds.
    most : int
        Look for at most this many rates, 1 or 2.

    Returns
    -------
    numpy.ndarray
        Energy decays as exp(-rate t), in 1/s; shape (1,) or (2,). Two differ by
        at least :data:`LEAST_RATIO`, and the second has to earn its place.

    Examples
    --------
    >>> times = np.arange(40) * 0.02
    >>> energies = np.outer([1.0, 2.0, 0.5], np.exp(-10 * times))
    >>> common_rates(energies, times, most=1).round(1)
    array([10.])
    """
    positive = energies[(energies > 0).all(axis=1)]
    span = float(times[-1] - times[0]) if len(times) > 1 else 0.0
    if len(positive) == 0 or len(times) < 4 or span <= 0:
        return np.array([_log_slope(positive, times)])
    start = times - times[0]
    smooth = _smoothed(positive, start)
    grid = np.geomspace(0.3 / span, 2.0 / float(start[1]), GRID)
    single, pair = np.zeros(1), np.zeros(2)
    worth = 0.0
    for _ in range(PASSES):
        single, loss_one = _search(positive, start, smooth, grid, 1)
        if most < 2:
            return single
        pair, loss_two = _search(positive, start, smooth, grid, 2)
        spare = len(positive) * (len(times) - 2)
        # The grid's own misfit must not buy a second rate.
        chance = max(loss_two / spare, EXACT)
        worth = (loss_one - loss_two) / len(positive) / chance
        smooth = _projected(positive, start, smooth, pair)
    return pair if worth > WORTH else single


def _log_slope(energies: np.ndarray, times: np.ndarray) -> float:
    if len(energies) == 0 or len(times) < 2:
        return 13.8
    level = np.log(energies).mean(axis=0)
    slope = -float(np.polyfit(times - times[0], level, 1)[0])
    return max(slope, 0.1)


def _smoothed(energies: np.ndarray, times: np.ndarray) -> np.ndarray:
    basis = np.vander(times / times[-1], 3)
    log = np.log(energies)
    fitted = basis @ np.linalg.lstsq(basis, log.T, rcond=None)[0]
    return np.exp(fitted.T)


def _projected(
    energies: np.ndarray, times: np.ndarray, smooth: np.ndarray, rates: np.ndarray
) -> np.ndarray:
    basis = np.exp(-np.outer(rates, times))
    inside = 1 / smooth
    normal = np.einsum("nt,kt,lt->nkl", inside**2, basis, basis)
    right = np.einsum("nt,kt->nk", inside**2 * energies, basis)
    ridge = 1e-9 * np.trace(normal, axis1=1, axis2=2)[:, None, None]
    amplitudes = np.linalg.solve(normal + ridge * np.eye(len(rates)), right[..., None])
    fitted = amplitudes[..., 0] @ basis
    return np.clip(fitted, 0.2 * smooth, 5 * smooth)


def _search(
    energies: np.ndarray,
    times: np.ndarray,
    smooth: np.ndarray,
    grid: np.ndarray,
    count: int,
) -> tuple[np.ndarray, float]:
    step = grid[1] / grid[0]
    ranges = [grid] if count == 1 else [grid, *np.array_split(grid, FAST_RANGES)]
    best, loss = np.array([grid[0]] * count), np.inf
    # The slow rate's misfit to the grid would choose the fast one, so that each
    # range of fast rates is refined before they are compared.
    for last in ranges[count - 1 :]:
        found, found_loss = _best(energies, times, smooth, [grid, last][-count:])
        for finer in (1.0, 0.25, 0.06):
            factors = step ** (finer * np.linspace(-1, 1, FINE))
            near = [factors * one for one in found]
            found, found_loss = _best(energies, times, smooth, near)
        if found_loss < loss:
            best, loss = found, found_loss
    return best, loss


def _best(
    energies: np.ndarray,
    times: np.ndarray,
    smooth: np.ndarray,
    grids: list[np.ndarray],
) -> tuple[np.ndarray, float]:
    """Return the rates with the least relative misfit, and the misfit."""
    weight = smooth**-2
    loss_start = float((weight * energies**2).sum())
    waves = [np.exp(-np.outer(grid, times)) for grid in grids]
    rights = [(weight * energies) @ wave.T for wave in waves]
    powers = [weight @ (wave**2).T for wave in waves]
    if len(grids) == 1:
        losses = loss_start - (rights[0] ** 2 / powers[0]).sum(axis=0)
        best = int(np.argmin(losses))
        return grids[0][[best]], float(losses[best])
    losses = loss_start - _pair_gains(weight, waves, rights, powers)
    losses[grids[1][None] < LEAST_RATIO * grids[0][:, None]] = np.inf
    slow, fast = divmod(int(np.argmin(losses)), losses.shape[1])
    found = np.array([grids[0][slow], grids[1][fast]])
    return found, float(losses[slow, fast])


def _pair_gains(
    weight: np.ndarray,
    waves: list[np.ndarray],
    rights: list[np.ndarray],
    powers: list[np.ndarray],
) -> np.ndarray:
    gains = np.empty((len(waves[0]), len(waves[1])))
    for slow, wave in enumerate(waves[0]):
        cross = weight @ (wave * waves[1]).T
        own, other = powers[0][:, [slow]], powers[1]
        first, second = rights[0][:, [slow]], rights[1]
        spread = np.maximum(own * other - cross**2, 1e-9 * own * other)
        gain = other * first**2 - 2 * cross * first * second + own * second**2
        gains[slow] = (gain / spread).sum(axis=0)
    return gains


def region_curves(
    energies: np.ndarray, first: np.ndarray, second: np.ndarray
) -> np.ndarray:
    """Return the mean decay of each pair of regions, shape (pairs of regions, bins).

    Single pairs are too noisy to tell a second rate from chance; their mean is
    not. Each pair counts the same, whatever its level.

    Parameters
    ----------
    energies : numpy.ndarray
        Shape (pairs, bins), positive.
    first, second : numpy.ndarray
        Number of each end's region, shape (pairs,).
    """
    low, high = np.minimum(first, second), np.maximum(first, second)
    keys = low * (int(high.max(initial=0)) + 1) + high
    level = np.exp(np.log(energies).mean(axis=1, keepdims=True))
    even = energies / level
    return np.stack([even[keys == key].mean(axis=0) for key in np.unique(keys)])
