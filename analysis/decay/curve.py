"""The compensated decay curve and the straight lines through it."""

import numpy as np
from numba import njit

from analysis.decay.model import FAST

__all__ = [
    "POINTS",
    "direct_end",
    "energy_after",
    "fill_curve",
    "fit_line",
    "moment",
    "soften",
]

POINTS = 2048
"""Points of the curve; short decays have one per sample."""


@njit(cache=True, fastmath=FAST)
def fill_curve(energy, start, end, noise, tail, curve):
    """Fill `curve` with the energy left after each step; return (steps, width).

    E_c(t) = sum_{t <= m < end} (e[m] - noise) + tail: the noise inside the integral
    is subtracted, the decay lost behind `end` is added (ISO 3382-1, 5.3.3).
    """
    width = max((end - start) // POINTS, 1)
    steps = (end - start + width - 1) // width
    curve[steps] = tail
    left = tail
    for step in range(steps - 1, -1, -1):
        first = start + step * width
        last = min(first + width, end)
        total = 0.0
        for n in range(first, last):
            total += energy[n]
        left += total - noise * (last - first)
        curve[step] = left
    return steps, width


@njit(cache=True, fastmath=FAST)
def moment(energy, start, end, noise):
    """Return sum n (e[n] - noise) from `start` to `end`, n counted from `start`."""
    total = 0.0
    for n in range(start, end):
        total += (n - start) * energy[n]
    length = end - start
    return total - noise * 0.5 * length * (length - 1.0)


@njit(cache=True)
def energy_after(energy, start, sample, noise, curve, width):
    """Return the compensated energy from a sample inside the curve on."""
    step = (sample - start) // width
    first = start + step * width
    gone = 0.0
    for n in range(first, sample):
        gone += energy[n] - noise
    return curve[step] - gone


@njit(cache=True)
def fit_line(curve, steps, width, upper, lower, line):
    """Fit a line to 10 lg E between two levels [dB]; return the number of points.

    `line` receives slope [dB/sample], correlation, levels covered [dB] and the
    largest single step [dB].
    """
    top = curve[0] * 10.0 ** (-0.1 * upper)
    bottom = curve[0] * 10.0 ** (-0.1 * lower)
    n = 0
    sw, sx, sy, sxx, sxy, syy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    last, jump, covered, origin = 0.0, 0.0, 0.0, 0
    for step in range(steps + 1):
        if curve[step] < bottom:
            break
        if curve[step] > top:
            continue
        y = 10.0 * np.log10(curve[step] / curve[0])
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


@njit(cache=True, fastmath=FAST)
def soften(energy, start, stop, wanted):
    """Scale a stretch down to a mean."""
    total = 0.0
    for n in range(start, stop):
        total += energy[n]
    mean = total / max(stop - start, 1)
    if mean > wanted:
        for n in range(start, stop):
            energy[n] *= wanted / mean


@njit(cache=True)
def direct_end(energy, onset, stop, reach):
    """Return one past `reach` samples behind the direct sound's peak."""
    peak = onset
    for n in range(onset, min(onset + reach + 1, stop)):
        if energy[n] > energy[peak]:
            peak = n
    return peak + reach + 1
