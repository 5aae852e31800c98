"""Where the decay meets the noise: zoomed blocks, first guess, outliers, fit."""

import numpy as np
from numba import njit

from analysis.decay.model import (
    BLOCKS,
    NOTHING,
    PARAMETERS,
    block_means,
    improve,
    level_at,
    slopes_of_model,
)

__all__ = ["FITTED", "NO_DECAY", "TOO_SHORT", "fit_decay"]

FITTED, NO_DECAY, TOO_SHORT = 0, 1, 2
MOST_EVENTS = 6
"""More outlying blocks than this are a pattern (flutter), not events."""


@njit(cache=True)
def steady_level(means, count):
    """Return the median of the last eighth of the blocks."""
    return np.median(means[count - max(count // 8, 3) : count])


@njit(cache=True)
def find_knee(means, count, noise):
    """Return the first block from which four in a row lie near the noise."""
    for k in range(1, count - 3):
        if max(means[k : k + 4]) < 1.7 * noise:
            return k
    return count


@njit(cache=True)
def empty_blocks(means, count):
    """Count blocks of (almost) nothing between blocks of something."""
    empty = 0
    for k in range(1, count - 1):
        if means[k] < 1e-6 * max(means[k + 1 : count]):
            empty += 1
    return empty


@njit(cache=True)
def zoom(energy, start, stop, count, means):
    """Shrink the window to 2.2 times the knee; return (width, knee, noise)."""
    end = stop
    width, knee, noise = 0, 0, 0.0
    for _ in range(8):
        width = block_means(energy, start, end, count, means)
        noise = steady_level(means, count)
        knee = find_knee(means, count, noise)
        wanted = int((2.2 * (knee + 1) + 4) * width)
        if wanted > 0.85 * (end - start) or wanted < 2 * count:
            break
        end = start + wanted
    return width, knee, noise


@njit(cache=True)
def first_block(means, knee, noise):
    """Return the first block within 25 dB of the noise, at least 6 before the knee."""
    for k in range(1, knee - 1):
        if max(means[k], means[k + 1]) < 316.0 * noise:
            return min(k, max(knee - 6, 1))
    return max(min(knee - 6, knee), 1)


@njit(cache=True)
def guess(means, first, knee, noise, theta):
    """Fill `theta` from a line through the logarithm; return False if it rises."""
    n = 0
    st, sy, stt, sty = 0.0, 0.0, 0.0, 0.0
    for k in range(first, knee):
        if means[k] > 1.2 * noise:
            t, y = k + 0.5, np.log(means[k] - 0.5 * noise)
            n, st, sy, stt, sty = n + 1, st + t, sy + y, stt + t * t, sty + t * y
    spread = n * stt - st * st
    if n < 2 or spread <= 0.0:
        return False
    slope = (n * sty - st * sy) / spread
    if slope >= -1e-4:
        return False
    theta[:] = NOTHING
    theta[0] = np.log(0.7 * noise)
    theta[1] = (sy - slope * st) / n
    theta[2] = np.log(-slope)
    return True


@njit(cache=True)
def residuals(theta, means, first, count, ratio):
    """Fill `ratio` with mu/m - 1 of the blocks."""
    slopes = np.zeros(PARAMETERS)
    for k in range(first, count):
        ratio[k] = means[k] / slopes_of_model(theta, k + 0.5, slopes) - 1.0


@njit(cache=True)
def spread_of(ratio, used, first, count, width):
    """Return the robust standard deviation of the residuals."""
    return max(
        1.4826 * np.median(np.abs(ratio[first:count][used[first:count]])),
        np.sqrt(2.0 / width),
    )


@njit(cache=True)
def is_patterned(ratio, first, count, width):
    """Return whether neighbouring residuals agree, or scatter more than chance."""
    products, squares = 0.0, 1e-30
    for k in range(first, count - 1):
        products += ratio[k] * ratio[k + 1]
        squares += ratio[k] * ratio[k]
    blocks = count - 1 - first
    if squares < 1e-8 * blocks:
        return False
    excess = squares / blocks * 0.5 * width > 1.5
    return products / squares > (0.5 if excess else 1.5) / np.sqrt(blocks)


@njit(cache=True)
def mark_events(ratio, used, first, count, spread):
    """Take out up to three blocks in a row that lie far above the model."""
    found = 0
    k = first
    while k < count:
        if ratio[k] <= max(6.0 * spread, 1.0):
            k += 1
            continue
        start, stop = k, k + 1
        while start > first and ratio[start - 1] > max(4.0 * spread, 0.7):
            start -= 1
        while stop < count and ratio[stop] > max(4.0 * spread, 0.7):
            stop += 1
        if stop - start <= 3:
            found += np.sum(used[start:stop])
            used[start:stop] = False
        k = stop
    return found


@njit(cache=True)
def mark_isolated(means, used, first, count):
    """Take out early single blocks 10 dB above both sides that leave no decay."""
    found = 0
    for k in range(3, min(first, count - 2)):
        before = max(means[k - 1], means[k - 2])
        after = max(means[k + 1], means[k + 2])
        late = means[k] < 0.1 * means[0] or before < 0.03 * means[0]
        if late and means[k] > 10.0 * max(before, after) and after < 1.3 * before:
            used[k] = False
            found += 1
    return found


@njit(cache=True)
def add_slope(theta, means, used, first, count, spread, best):
    """Add a second decay where it explains the blocks clearly better."""
    silent = theta[0] == NOTHING
    free = np.arange(1 if silent else 0, PARAMETERS)
    floor = np.log(np.exp(theta[0]) + level_at(theta, count))
    kept = theta.copy()
    chosen = best
    for ratio in (2.5, 6.0):
        trial = theta.copy()
        trial[2] = theta[2] + 0.1
        trial[4] = theta[2] - np.log(ratio)
        trial[3] = floor + np.log(0.5) + np.exp(trial[4]) * 0.5 * count
        trial[0] = theta[0] + np.log(0.7)
        value = improve(trial, means, used, first, count, free)
        if trial[4] > trial[2]:
            trial[1], trial[3] = trial[3], trial[1]
            trial[2], trial[4] = trial[4], trial[2]
        seen = np.exp(trial[4]) * (count - first) > 1.0
        apart = trial[2] - trial[4] > 0.25
        if seen and apart and value < chosen - 15.0 * spread * spread:
            chosen = value
            kept[:] = trial
    theta[:] = kept


@njit(cache=True)
def drop_noise(theta, means, used, first, count, width, best):
    """Leave the noise out where the blocks do not ask for it; return the deviance."""
    if level_at(theta, count) < 0.2 * np.exp(theta[0]):
        return best
    trial = theta.copy()
    trial[0] = NOTHING
    value = improve(trial, means, used, first, count, np.arange(1, 3))
    if value > best + 8.0 / width:
        return best
    theta[:] = trial
    return value


@njit(cache=True)
def fit_once(energy, start, stop, count, means, theta, used, ratio):
    """Fit with a given number of blocks; return (state, width, first, events)."""
    width, knee, noise = zoom(energy, start, stop, count, means)
    if count > 8 and empty_blocks(means, count) > 1:
        return -1, width, 1, 0, count
    while knee >= count - 2 and count > 12 and means[count - 1] < 0.1 * noise:
        count -= 1
    if noise <= 0.0:
        noise = 1e-3 * means[means > 0.0].min() if means.max() > 0.0 else 1e-30
    knee = min(knee, count)
    first = first_block(means, knee, noise)
    used[:] = True
    theta[0] = np.log(noise)
    if not guess(means, first, knee, noise, theta):
        return NO_DECAY, width, first, 0, count
    free = np.arange(3)
    mark_isolated(means, used, first, count)
    best = improve(theta, means, used, first, count, free)
    best = drop_noise(theta, means, used, first, count, width, best)
    if theta[0] == NOTHING:
        free = np.arange(1, 3)
    for attempt in range(4):
        residuals(theta, means, first, count, ratio)
        spread = spread_of(ratio, used, first, count, width)
        if (
            attempt == 1
            and count - first >= 20
            and is_patterned(ratio, first, count, width)
        ):
            add_slope(theta, means, used, first, count, spread, best)
            residuals(theta, means, first, count, ratio)
            used[first:count] = True
            if theta[3] > NOTHING:
                free = np.arange(free[0], PARAMETERS)
        found = mark_events(ratio, used, first, count, spread)
        if attempt > 1 and found == 0:
            break
        best = improve(theta, means, used, first, count, free)
    events = np.sum(~used[:count])
    if events > MOST_EVENTS and count > 16:
        return -1, width, first, events, count
    return FITTED, width, first, events, count


@njit(cache=True)
def fit_decay(energy, start, stop, means, theta, used, ratio):
    """Fit decays and noise to a response; times are in blocks of `width` samples.

    Returns state, width, first fitted block, number of outlying blocks, blocks.
    """
    count = min(BLOCKS, (stop - start) // 2)
    if count < 8:
        return TOO_SHORT, 1, 0, 0, count
    result = fit_once(energy, start, stop, count, means, theta, used, ratio)
    while result[0] < 0 and count > 8:
        count = max(count // 2, 8)
        result = fit_once(energy, start, stop, count, means, theta, used, ratio)
    if result[0] < 0:
        return NO_DECAY, result[1], result[2], 0, result[4]
    return result
