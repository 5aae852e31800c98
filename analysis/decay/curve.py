"""The compensated decay curve and the straight lines through it."""

import numpy as np
from numba import njit

from analysis.decay.model import FAST, crossing, tail_after

__all__ = [
    "close_curve",
    "direct_end",
    "energy_after",
    "envelope_energy",
    "fit_lines",
    "soften",
    "step_at",
]


@njit(cache=True, nogil=True, fastmath=FAST)
def fill_curve(energy, start, end, noise, tail, points, curve):
    """Fill `curve` with the energy left after each step; return (steps, width, first).

    E_c(t) = sum_{t <= m < end} (e[m] - noise) + tail: the noise inside the integral
    is subtracted, the decay lost behind `end` is added (ISO 3382-1, 5.3.3). `first`
    is sum n (e[n] - noise), n counted from `start`.
    """
    width = max((end - start) // points, 1)
    steps = (end - start + width - 1) // width
    curve[steps] = tail
    left, moment = tail, 0.0
    for step in range(steps - 1, -1, -1):
        first = start + step * width
        last = min(first + width, end)
        total, inner = 0.0, 0.0
        for n in range(first, last):
            total += energy[n]
            inner += (n - first) * energy[n]
        left += total - noise * (last - first)
        moment += inner + total * (first - start)
        curve[step] = left
    length = end - start
    return steps, width, moment - noise * 0.5 * length * (length - 1.0)


@njit(cache=True, nogil=True)
def close_curve(energy, onset, start, stop, theta, block, points, curve):
    """Find the crossing, fill the curve to it and close it by the tail.

    Returns end, noise, tail, steps, width, first moment.
    """
    end = min(onset + int(crossing(theta, (stop - onset) / block) * block), stop)
    noise = np.exp(theta[0])
    tail = tail_after(theta, (end - onset) / block) * block
    steps, width, first = fill_curve(energy, start, end, noise, tail, points, curve)
    return end, noise, tail, steps, width, first


@njit(cache=True, nogil=True)
def energy_after(energy, start, sample, noise, curve, width):
    """Return the compensated energy from a sample inside the curve on."""
    step = (sample - start) // width
    first = start + step * width
    gone = 0.0
    for n in range(first, sample):
        gone += energy[n] - noise
    return curve[step] - gone


@njit(cache=True, nogil=True)
def step_at(curve, steps, left):
    """Return the first step with no more than some energy left."""
    for step in range(steps + 1):
        if curve[step] <= left:
            return step
    return steps


@njit(cache=True, nogil=True)
def fill_levels(curve, steps, lowest, levels):
    """Fill `levels` with 10 lg E down to a level [dB]; return how many."""
    bottom = curve[0] * 10.0 ** (-0.1 * lowest)
    origin, scale = np.log(curve[0]), 10.0 / np.log(10.0)
    for step in range(steps + 1):
        if curve[step] < bottom:
            return step
        levels[step] = scale * (np.log(curve[step]) - origin)
    return steps + 1


@njit(cache=True, nogil=True)
def fit_line(levels, begin, count, width, upper, lower, line):
    """Fit a line to the levels between two limits [dB]; return the number of points.

    `line` receives slope [dB/sample], correlation, levels covered [dB] and the
    largest single step [dB].
    """
    n = 0
    sw, sx, sy, sxx, sxy, syy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    last, jump, covered, origin = 0.0, 0.0, 0.0, 0
    for step in range(begin, count):
        y = levels[step]
        if y > -upper:
            continue
        if y < -lower:
            break
        # The direct sound is one sample before the rest, not a whole step.
        weight = 1.0 / width if step == 0 else 1.0
        if n == 0:
            origin = step
        elif step > 1:
            jump = max(jump, last - y)
            covered += last - y
        x = float(step - origin)
        n += 1
        sw += weight
        sx += weight * x
        sy += weight * y
        sxx += weight * x * x
        sxy += weight * x * y
        syy += weight * y * y
        last = y
    vx, vy, c = sw * sxx - sx * sx, sw * syy - sy * sy, sw * sxy - sx * sy
    if n < 2 or vx <= 0.0 or vy <= 0.0:
        return 0
    line[0] = c / vx / width
    line[1] = c / np.sqrt(vx * vy)
    line[2] = covered
    line[3] = jump
    return n


@njit(cache=True, nogil=True)
def fit_lines(curve, begin, later, steps, width, limits, lines):
    """Fit lines from `begin` (the first) and `later` on; the last column counts."""
    levels = np.empty(steps + 1)
    count = fill_levels(curve, steps, limits[-1, 1], levels)
    for row in range(len(limits)):
        start = begin if row == 0 else later
        lines[row, 4] = fit_line(
            levels, start, count, width, limits[row, 0], limits[row, 1], lines[row]
        )


@njit(cache=True, nogil=True, fastmath=FAST)
def soften(energy, start, stop, wanted):
    """Scale a stretch down to a mean."""
    total = 0.0
    for n in range(start, stop):
        total += energy[n]
    mean = total / max(stop - start, 1)
    if mean > wanted:
        for n in range(start, stop):
            energy[n] *= wanted / mean


@njit(cache=True, nogil=True)
def direct_end(energy, onset, stop, reach):
    """Return one past `reach` samples behind the direct sound's peak."""
    peak = onset
    for n in range(onset, min(onset + reach + 1, stop)):
        if energy[n] > energy[peak]:
            peak = n
    return peak + reach + 1


@njit(cache=True, nogil=True, fastmath=FAST)
def envelope_energy(envelope, scale):
    """Return scaled squared magnitudes of complex rows."""
    energy = np.empty(envelope.shape)
    for row in range(envelope.shape[0]):
        for n in range(envelope.shape[1]):
            z = envelope[row, n]
            energy[row, n] = scale * (z.real * z.real + z.imag * z.imag)
    return energy
