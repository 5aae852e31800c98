"""One response from samples to parameters, compiled; and a batch of them."""

import numpy as np
from numba import njit

from analysis.decay import words
from analysis.decay.curve import POINTS, energy_after, fill_curve, fit_line, moment
from analysis.decay.model import (
    BLOCKS,
    FAST,
    PARAMETERS,
    crossing,
    level_at,
    tail_after,
)
from analysis.decay.noise import FITTED, TOO_SHORT, fit_decay

__all__ = ["analyse_batch"]

# Places in the row of values and the row of further facts.
EDT, T20, T30, C50, C80, DRR, D50, TS = range(8)
RANGE, NOISE, SIGNAL, CURVATURE, XI20, XI30, ONSET, CROSSING, TAIL_TIME = range(9)
N_VALUES, N_FACTS = 8, 9
MARGIN = 3.0
"""How far below a fit's end the noise crossing must lie on the curve [dB]."""


@njit(cache=True, fastmath=FAST)
def is_finite(samples):
    """Return whether every sample is finite."""
    bad = 0.0
    for n in range(len(samples)):
        bad += samples[n] * 0.0
    return bad == 0.0


@njit(cache=True, fastmath=True)
def extremes(samples):
    """Return the smallest and the largest of finite samples."""
    low, high = samples[0], samples[0]
    for n in range(len(samples)):
        low = min(low, samples[n])
        high = max(high, samples[n])
    return low, high


@njit(cache=True, fastmath=True)
def count_equal(samples, value):
    """Return how many samples have exactly a value."""
    count = 0.0
    for n in range(len(samples)):
        count += 1.0 if samples[n] == value else 0.0
    return count


@njit(cache=True)
def is_clipped(samples, low, high):
    """Return whether a value near full level comes back four times or more."""
    peak = max(high, -low)
    repeated = 0.0
    if high >= 0.5 * peak:
        repeated += count_equal(samples, high)
    if low <= -0.5 * peak:
        repeated += count_equal(samples, low)
    return repeated >= 4.0


@njit(cache=True, fastmath=FAST)
def sum_of(samples, start, stop):
    """Return the sum of a stretch."""
    total = 0.0
    for n in range(start, stop):
        total += samples[n]
    return total


@njit(cache=True)
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
    middle = np.median(means)
    error = 1.4826 * np.median(np.abs(means - middle)) / np.sqrt(parts)
    early, late = means[: parts // 2].mean(), means[parts // 2 :].mean()
    drifting = abs(early - late) > max(0.2 * abs(middle), 6.0 * error)
    if drifting or abs(middle) <= 8.0 * error:
        return 0.0
    return means.mean()


@njit(cache=True, fastmath=FAST)
def square(samples, offset, peak, energy):
    """Fill `energy` with the squares of the samples over the peak."""
    for n in range(len(samples)):
        value = (samples[n] - offset) / peak
        energy[n] = value * value


@njit(cache=True)
def find_first(energy, start, level):
    """Return the first sample at or above a level from `start` on, or -1."""
    for n in range(start, len(energy)):
        if energy[n] >= level:
            return n
    return -1


@njit(cache=True)
def find_stop(energy, level):
    """Return one past the last sample above a level."""
    for n in range(len(energy) - 1, -1, -1):
        if energy[n] > level:
            return n + 1
    return 0


@njit(cache=True)
def onset_level(energy, stop):
    """Return -20 dB, or more where the noise at the end would reach that."""
    start, parts = (3 * stop) // 4, 16
    width = max((stop - start) // parts, 1)
    means = np.empty(parts)
    for part in range(parts):
        first = min(start + part * width, stop - 1)
        means[part] = sum_of(energy, first, min(first + width, stop)) / width
    return min(max(0.01, 30.0 * np.median(means)), 0.25)


@njit(cache=True)
def count_pulses(energy, start, stop, most):
    """Count samples of more than -120 dB, up to `most`."""
    pulses = 0
    for n in range(start, stop):
        if energy[n] > 1e-12:
            pulses += 1
            if pulses >= most:
                break
    return pulses


@njit(cache=True)
def skip_click(energy, onset, stop, rate, noise, level):
    """Return the onset behind an isolated click, or the same onset."""
    first = onset + int(0.002 * rate) + 1
    after = find_first(energy, first, level)
    if after < 0 or after - first < 0.03 * rate or after + int(0.012 * rate) >= stop:
        return onset
    gap = energy[first : after - 1].mean()
    click = energy[onset:first].max()
    decay = energy[after + int(0.002 * rate) : after + int(0.012 * rate)].mean()
    quiet = gap <= 1e-4 * click and gap <= 3.0 * noise + 1e-7
    if quiet and click < 0.5 and decay > 30.0 * gap and decay > 1e-5:
        return after
    return onset


@njit(cache=True)
def soften_events(energy, onset, end, width, used, first, count, theta):
    """Bring outlying blocks before `end` down to the model's energy."""
    for k in range(count):
        start = onset + k * width
        if used[k] or start >= end:
            continue
        stop = min(start + width, len(energy))
        mean = energy[start:stop].mean()
        if k >= first:
            wanted = level_at(theta, k + 0.5) + np.exp(theta[0])
        else:
            wanted = energy[start - width : start].mean()
        if mean > wanted:
            energy[start:stop] *= wanted / mean


@njit(cache=True)
def pulse_energies(energy, onset, stop, rate, values, reasons):
    """Fill the energy parameters of a handful of single pulses; T has no meaning."""
    total, late50, late80, reverberant, first = 0.0, 0.0, 0.0, 0.0, 0.0
    direct = int(0.0025 * rate + 0.5)
    for n in range(onset, stop):
        k = n - onset
        total += energy[n]
        first += k * energy[n]
        late50 += energy[n] if k >= int(0.05 * rate + 0.5) else 0.0
        late80 += energy[n] if k >= int(0.08 * rate + 0.5) else 0.0
        reverberant += energy[n] if k > direct else 0.0
    reasons[:3] = words.PULSES
    for place, late in ((C50, late50), (C80, late80), (DRR, reverberant)):
        if 0.0 < late < total:
            values[place] = 10.0 * np.log10((total - late) / late)
        else:
            reasons[place] = words.NO_LATE
    values[D50] = 1.0 - late50 / total
    values[TS] = first / total / rate


@njit(cache=True)
def times_from_curve(curve, steps, width, rate, floor, values, facts, reasons):
    """Fill EDT, T20, T30 and the quality of their lines."""
    line = np.empty(4)
    for place in range(3):
        upper = 0.0 if place == EDT else 5.0
        lower = 10.0 if place == EDT else (25.0 if place == T20 else 35.0)
        if floor > -lower - MARGIN:
            reasons[place] = words.RANGE_SHORT
            continue
        points = fit_line(curve, steps, width, upper, lower, line)
        if points < 4 or line[2] < 0.3:
            reasons[place] = words.NO_POINTS
        elif line[3] > 0.5 * (lower - upper):
            reasons[place] = words.PULSES
        elif line[1] > (-0.3 if place == EDT else -0.8):
            reasons[place] = words.NOT_STRAIGHT
        else:
            values[place] = -60.0 / line[0] / rate
            if place > 0:
                facts[XI20 + place - 1] = 1000.0 * (1.0 - line[1] ** 2)


@njit(cache=True)
def late_ratio(total, late, tail, values, place, reasons):
    """Fill 10 lg(early/late) if the late energy stands clear of the tail."""
    if late < 0.9 * tail:
        reasons[place] = words.LATE_BURIED
    elif late >= total or late <= 0.0:
        reasons[place] = words.NO_LATE
    else:
        values[place] = 10.0 * np.log10((total - late) / late)


@njit(cache=True)
def late_energy(energy, onset, end, sample, noise, curve, width, theta, block):
    """Return the energy from a sample on, by the model behind the crossing."""
    if sample < end:
        return energy_after(energy, onset, sample, noise, curve, width)
    return tail_after(theta, (sample - onset) / block) * block


@njit(cache=True)
def direct_end(energy, onset, stop, rate):
    """Return one past 2.5 ms after the direct sound's peak."""
    reach = int(0.0025 * rate + 0.5)
    window = energy[onset : min(onset + reach + 1, stop)]
    return onset + int(window.argmax()) + reach + 1


@njit(cache=True)
def analyse_energy(
    energy, onset, stop, rate, block, theta, curve, values, facts, reasons
):
    """Fill the parameters from squared samples and a fitted model; return flags."""
    end_block = crossing(theta, (stop - onset) / block)
    end = min(onset + int(end_block * block), stop)
    noise = np.exp(theta[0])
    if end - onset < 4:
        reasons[:] = words.UNDER_NOISE
        return words.NO_DECAY
    tail = tail_after(theta, (end - onset) / block) * block
    steps, width = fill_curve(energy, onset, end, noise, tail, curve)
    total = curve[0]
    floor = 10.0 * np.log10(tail / total) if total > tail else 0.0
    facts[RANGE], facts[NOISE] = -floor, noise
    facts[ONSET], facts[CROSSING] = onset / rate, (end - onset) / rate
    facts[TAIL_TIME] = (
        13.8155 * block / np.exp(theta[2] if theta[3] == -np.inf else theta[4]) / rate
    )
    if floor > -10.0:
        reasons[:] = words.RANGE_SHORT
        return words.LOW_RANGE
    flags = words.LOW_RANGE if floor > -45.0 else 0
    times_from_curve(curve, steps, width, rate, floor, values, facts, reasons)
    for place, sample in (
        (C50, onset + int(0.05 * rate + 0.5)),
        (C80, onset + int(0.08 * rate + 0.5)),
        (DRR, direct_end(energy, onset, stop, rate)),
    ):
        late = late_energy(
            energy, onset, end, sample, noise, curve, width, theta, block
        )
        late_ratio(total, late, tail, values, place, reasons)
        if place == C50:
            values[D50] = min(max(1.0 - late / total, 0.0), 1.0)
    first = moment(energy, onset, end, noise)
    rate_tail = np.exp(theta[2] if theta[3] == -np.inf else theta[4]) / block
    values[TS] = (first + tail * (end - onset + 1.0 / rate_tail)) / total / rate
    facts[SIGNAL] = total
    if values[T20] > 0:
        longest = values[T30] if values[T30] > 0 else values[T20]
        facts[CURVATURE] = 100.0 * (values[T30] / values[T20] - 1.0)
        if abs(longest / values[T20] - 1.0) > 0.1:
            flags |= words.CURVED
    return flags


@njit(cache=True)
def analyse_response(samples, rate, energy, curve, values, facts, reasons):
    """Fill the rows of one response; return its flags."""
    values[:], facts[:], reasons[:] = np.nan, np.nan, 0
    if not is_finite(samples):
        reasons[:] = words.NOT_FINITE
        return words.NON_FINITE
    low, high = extremes(samples)
    peak = max(high, -low)
    if peak == 0.0:
        reasons[:] = words.ALL_ZERO
        return words.SILENT
    flags = words.CLIPPED if is_clipped(samples, low, high) else 0
    offset = steady_offset(samples)
    if offset != 0.0:
        flags |= words.DC_OFFSET
        before = peak
        peak = max(high - offset, offset - low)
        if peak <= 1e-9 * before:
            reasons[:] = words.ALL_CONSTANT
            return flags | words.SILENT
    square(samples, offset, peak, energy)
    stop = find_stop(energy, 1e-12)
    onset = find_first(energy, 0, onset_level(energy, stop))
    pulses = count_pulses(energy, onset, stop, 16)
    if pulses == 1:
        reasons[:] = words.ONE_PULSE
        return flags | words.NO_DECAY
    if pulses < 16 and stop - onset >= 2 * pulses:
        pulse_energies(energy, onset, stop, rate, values, reasons)
        return flags | words.NO_DECAY
    return flags | model_and_curve(
        energy, onset, stop, rate, curve, values, facts, reasons
    )


@njit(cache=True)
def model_and_curve(energy, onset, stop, rate, curve, values, facts, reasons):
    """Fit the noise, correct the onset by it, and fill the parameters."""
    means, theta = np.zeros(BLOCKS), np.full(PARAMETERS, -np.inf)
    used, ratio = np.ones(BLOCKS, dtype=np.bool_), np.zeros(BLOCKS)
    flags = 0
    state, block, first, events, count = fit_decay(
        energy, onset, stop, means, theta, used, ratio
    )
    noise = np.exp(theta[0])
    level = min(max(0.01, 30.0 * noise), 0.25)
    moved = find_first(energy, 0, level)
    for _ in range(4):
        behind = skip_click(energy, moved, stop, rate, noise, level)
        if behind == moved:
            break
        moved = behind
        flags |= words.EARLY_CLICK
    if moved != onset:
        onset = moved
        state, block, first, events, count = fit_decay(
            energy, onset, stop, means, theta, used, ratio
        )
    if state != FITTED:
        reasons[:] = words.SHORT_RECORD if state == TOO_SHORT else words.UNDER_NOISE
        return flags | words.NO_DECAY
    beyond = onset + count * block
    level = 70.0 * (np.exp(theta[0]) + level_at(theta, count))
    if largest(energy, beyond, stop) > level and beyond < 0.9 * stop:
        flags |= words.TAIL_EVENT
    if events > 0:
        flags |= words.TAIL_EVENT
        soften_events(energy, onset, stop, block, used, first, count, theta)
    return flags | analyse_energy(
        energy, onset, stop, rate, block, theta, curve, values, facts, reasons
    )


@njit(cache=True, fastmath=True)
def largest(energy, start, stop):
    """Return the largest value of a stretch."""
    value = 0.0
    for n in range(start, stop):
        value = max(value, energy[n])
    return value


@njit(cache=True)
def analyse_batch(samples, rate, values, facts, reasons, flags):
    """Fill the rows of every response of (rows, n)."""
    rows, n = samples.shape
    energy = np.empty(n)
    curve = np.empty(2 * POINTS + 2)
    for row in range(rows):
        flags[row] = analyse_response(
            samples[row], rate, energy, curve, values[row], facts[row], reasons[row]
        )
