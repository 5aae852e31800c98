"""Kernels on block energies: window, first guess, residuals, outliers."""

import numpy as np
from numba import njit

from analysis.decay.model import (
    NOTHING,
    PARAMETERS,
    block_means,
    slopes_of_model,
)

__all__ = ["begin", "judge", "zoom"]


@njit(cache=True, nogil=True)
def median_of(values):
    """Return the median of a short array, which is left sorted."""
    for i in range(1, len(values)):
        value = values[i]
        j = i - 1
        while j >= 0 and values[j] > value:
            values[j + 1] = values[j]
            j -= 1
        values[j + 1] = value
    half = len(values) // 2
    if len(values) % 2:
        return values[half]
    return 0.5 * (values[half - 1] + values[half])


@njit(cache=True, nogil=True)
def steady_level(means, count):
    """Return the median of the last eighth of the blocks."""
    return median_of(means[count - max(count // 8, 3) : count].copy())


@njit(cache=True, nogil=True)
def find_knee(means, count, noise):
    """Return the first block from which four in a row lie near the noise."""
    in_row = 0
    for k in range(1, count):
        in_row = in_row + 1 if means[k] < 1.7 * noise else 0
        if in_row == 4:
            return k - 3
    return count


@njit(cache=True, nogil=True)
def empty_blocks(means, count):
    """Count blocks of (almost) nothing between blocks of something."""
    empty, later = 0, means[count - 1]
    for k in range(count - 2, 0, -1):
        if means[k] < 1e-6 * later:
            empty += 1
        later = max(later, means[k])
    return empty


@njit(cache=True, nogil=True)
def zoom(energy, start, stop, count, least, means, wide):
    """Shrink the window to 2.2 times the knee; return (width, knee, noise, empty).

    Blocks never get narrower than `least` samples. `wide` keeps the means of the
    whole response.
    """
    end = stop
    width, knee, noise = 0, 0, 0.0
    for turn in range(8):
        width = block_means(energy, start, end, count, means)
        if turn == 0:
            wide[:] = means
        noise = steady_level(means, count)
        knee = find_knee(means, count, noise)
        wanted = int((2.2 * (knee + 1) + 4) * width)
        if wanted > 0.85 * (end - start) or wanted < least * count:
            break
        end = start + wanted
    return width, knee, noise, empty_blocks(means, count)


@njit(cache=True, nogil=True)
def first_block(means, knee, noise):
    """Return the first block within 25 dB of the noise, at least 6 before the knee."""
    for k in range(1, knee - 1):
        if max(means[k], means[k + 1]) < 316.0 * noise:
            return min(k, max(knee - 6, 1))
    return max(min(knee - 6, knee), 1)


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def is_patterned(ratio, first, count):
    """Return whether residuals stay on one side longer than chance lets them.

    Neighbours must not agree, and sums of six blocks not exceed the scatter from
    block to block.
    """
    groups = (count - first) // 6
    if groups < 2:
        return False
    sums, steps, products, squares = 0.0, 0.0, 0.0, 1e-30
    for group in range(groups):
        total = 0.0
        for k in range(first + 6 * group, first + 6 * group + 6):
            value = min(max(ratio[k], -1.0), 1.0)
            total += value
            squares += value * value
            if k > first:
                before = min(max(ratio[k - 1], -1.0), 1.0)
                steps += (value - before) ** 2
                products += value * before
        sums += total * total
    if squares < 6e-8 * groups:
        return False
    scatter = steps / (12.0 * groups)
    excess = sums / (6.0 * groups) > scatter * (1.0 + np.sqrt(2.0 / groups))
    return excess or products / squares > 1.0 / np.sqrt(6.0 * groups)


@njit(cache=True, nogil=True)
def residuals(theta, means, used, first, count, freedom, ratio):
    """Fill `ratio` with mu/m - 1; return its robust spread and if it has a pattern."""
    slopes = np.zeros(PARAMETERS)
    sizes = np.empty(count)
    n = 0
    for k in range(first, count):
        ratio[k] = means[k] / slopes_of_model(theta, k + 0.5, slopes) - 1.0
        if used[k]:
            sizes[n] = abs(ratio[k])
            n += 1
    spread = max(1.4826 * median_of(sizes[:n]), np.sqrt(2.0 / freedom))
    return spread, is_patterned(ratio, first, count)


@njit(cache=True, nogil=True)
def mark_events(ratio, used, first, count, spread):
    """Take out up to three blocks in a row that lie far above the model.

    The first blocks belong to an earlier, steeper decay instead.
    """
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
        if stop - start <= 3 and start > first:
            for j in range(start, stop):
                found += used[j]
                used[j] = False
        k = stop
    return found


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def begin(means, used, count, knee, noise, theta):
    """Return the first block to fit and whether a decay shows; fill a first guess."""
    first = first_block(means, knee, noise)
    if not guess(means, first, knee, noise, theta):
        return first, False
    mark_isolated(means, used, first, count)
    return first, True


@njit(cache=True, nogil=True)
def judge(theta, means, used, first, count, freedom, ratio):
    """Return the residuals' spread, if they have a pattern, and new outliers."""
    spread, patterned = residuals(theta, means, used, first, count, freedom, ratio)
    return spread, patterned, mark_events(ratio, used, first, count, spread)
