"""The compensated decay curve and the straight lines through it."""

import numpy as np
from numba import njit

from analysis.decay.model import FAST

__all__ = ["POINTS", "energy_after", "fill_curve", "fit_line", "moment"]

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
    sx, sy, sxx, sxy, syy = 0.0, 0.0, 0.0, 0.0, 0.0
    last, first_level, jump, origin = 0.0, 0.0, 0.0, 0
    # The point before the direct sound would weigh as much as a whole step.
    for step in range(1 if width > 1 else 0, steps + 1):
        if curve[step] < bottom:
            break
        if curve[step] > top:
            continue
        y = 10.0 * np.log10(curve[step] / curve[0])
        if n == 0:
            first_level, origin = y, step
        else:
            jump = max(jump, last - y)
        x = float(step - origin)
        n, sx, sy, sxx, sxy, syy = (
            n + 1,
            sx + x,
            sy + y,
            sxx + x * x,
            sxy + x * y,
            syy + y * y,
        )
        last = y
    vx, vy, c = n * sxx - sx * sx, n * syy - sy * sy, n * sxy - sx * sy
    if n < 2 or vx <= 0.0 or vy <= 0.0:
        return 0
    line[0] = c / vx / width
    line[1] = c / np.sqrt(vx * vy)
    line[2] = first_level - last
    line[3] = jump
    return n
