"""Kernels on samples: extremes, offset, squares, direct sound, clicks."""

import numpy as np
from numba import njit

from analysis.decay.blocks import median_of
from analysis.decay.model import FAST

__all__ = ["inspect", "largest", "locate", "onset_level", "skip_click", "square"]


@njit(cache=True, nogil=True, fastmath=FAST)
def is_finite(samples):
    """Return whether every sample is finite."""
    bad = 0.0
    for n in range(len(samples)):
        bad += samples[n] * 0.0
    return bad == 0.0


@njit(cache=True, nogil=True, fastmath=True)
def extremes(samples):
    """Return the smallest and the largest of finite samples."""
    low, high = samples[0], samples[0]
    for n in range(len(samples)):
        low = min(low, samples[n])
        high = max(high, samples[n])
    return low, high


@njit(cache=True, nogil=True, fastmath=True)
def count_equal(samples, value):
    """Return how many samples have exactly a value."""
    count = 0.0
    for n in range(len(samples)):
        count += 1.0 if samples[n] == value else 0.0
    return count


@njit(cache=True, nogil=True)
def is_clipped(samples, low, high):
    """Return whether a value near full level comes back four times or more."""
    peak = max(high, -low)
    repeated = 0.0
    if high >= 0.5 * peak:
        repeated += count_equal(samples, high)
    if low <= -0.5 * peak:
        repeated += count_equal(samples, low)
    return repeated >= 4.0


@njit(cache=True, nogil=True, fastmath=FAST)
def sum_of(samples, start, stop):
    """Return the sum of a stretch."""
    total = 0.0
    for n in range(start, stop):
        total += samples[n]
    return total


@njit(cache=True, nogil=True)
def steady_offset(samples):
    """Return the offset of the last quarter if it is there in all of its parts."""
    start, parts = (3 * len(samples)) // 4, 16
    width = (len(samples) - start) // parts
    if width < 2:
        return 0.0
    means = np.empty(parts)
    for part in range(parts):
        first = start + part * width
        means[part] = sum_of(samples, first, first + width) / width
    half = parts // 2
    early, late = sum_of(means, 0, half) / half, sum_of(means, half, parts) / half
    middle = median_of(means.copy())
    error = 1.4826 * median_of(np.abs(means - middle)) / np.sqrt(parts)
    drifting = abs(early - late) > max(0.2 * abs(middle), 6.0 * error)
    if drifting or abs(middle) <= 8.0 * error:
        return 0.0
    return 0.5 * (early + late)


@njit(cache=True, nogil=True, fastmath=FAST)
def square(samples, offset, peak, energy):
    """Fill `energy` with the squares of the samples over the peak."""
    for n in range(len(samples)):
        value = (samples[n] - offset) / peak
        energy[n] = value * value


@njit(cache=True, nogil=True)
def find_first(energy, start, level):
    """Return the first sample at or above a level from `start` on, or -1."""
    for n in range(start, len(energy)):
        if energy[n] >= level:
            return n
    return -1


@njit(cache=True, nogil=True)
def find_stop(energy, level):
    """Return one past the last sample above a level."""
    for n in range(len(energy) - 1, -1, -1):
        if energy[n] > level:
            return n + 1
    return 0


@njit(cache=True, nogil=True)
def onset_level(energy, stop):
    """Return -20 dB, or more where the noise at the end would reach that."""
    start, parts = (3 * stop) // 4, 16
    width = max((stop - start) // parts, 1)
    means = np.empty(parts)
    for part in range(parts):
        first = min(start + part * width, stop - 1)
        means[part] = sum_of(energy, first, min(first + width, stop)) / width
    return min(max(0.01, 30.0 * median_of(means)), 0.25)


@njit(cache=True, nogil=True)
def count_pulses(energy, start, stop, most):
    """Count samples of more than -120 dB, up to `most`."""
    pulses = 0
    for n in range(start, stop):
        if energy[n] > 1e-12:
            pulses += 1
            if pulses >= most:
                break
    return pulses


@njit(cache=True, nogil=True, fastmath=True)
def largest(energy, start, stop):
    """Return the largest value of a stretch."""
    value = 0.0
    for n in range(start, stop):
        value = max(value, energy[n])
    return value


@njit(cache=True, nogil=True)
def skip_click(energy, onset, stop, rate, noise, level):
    """Return the onset behind an isolated click, or the same onset."""
    first = onset + int(0.002 * rate) + 1
    after = find_first(energy, first, level)
    if after < 0 or after - first < 0.03 * rate or after + int(0.012 * rate) >= stop:
        return onset
    # The first samples of a decay may lie under the level.
    last = after - int(0.001 * rate) - 1
    gap = sum_of(energy, first, last) / (last - first)
    click = largest(energy, onset, first)
    begin, end = after + int(0.002 * rate), after + int(0.012 * rate)
    decay = sum_of(energy, begin, end) / max(end - begin, 1)
    quiet = gap <= 1e-4 * click and gap <= 3.0 * noise + 1e-7
    if quiet and click < 0.5 and decay > 30.0 * gap and decay > 1e-5:
        return after
    return onset


@njit(cache=True, nogil=True)
def inspect(samples):
    """Return whether samples are finite, their extremes, clipping, and offset."""
    if not is_finite(samples):
        return False, 0.0, 0.0, False, 0.0
    low, high = extremes(samples)
    if low == 0.0 and high == 0.0:
        return True, 0.0, 0.0, False, 0.0
    return True, low, high, is_clipped(samples, low, high), steady_offset(samples)


@njit(cache=True, nogil=True)
def locate(energy):
    """Return the direct sound, the end above -120 dB, and up to 16 pulses."""
    stop = find_stop(energy, 1e-12)
    onset = find_first(energy, 0, onset_level(energy, stop))
    return onset, stop, count_pulses(energy, onset, stop, 16)
