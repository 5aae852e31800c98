"""What one image is in one half octave, compiled: its value, its place, its shape."""

import numpy as np
from numba import njit

__all__ = ["add_arrivals", "folded", "heard_arrivals", "place_arrivals", "planar"]

TURNS = 1024
"""Nodes of a turn; between them three terms of the exponential are exact to 1e-11."""
_COSINE = np.cos(2 * np.pi * np.arange(TURNS) / TURNS)
_SINE = np.sin(2 * np.pi * np.arange(TURNS) / TURNS)
LANES = 4
BITS = 8


@njit(cache=True, fastmath=True)
def planar(taps, widths):
    """Return taps with real and imaginary parts apart, and widths in full lanes."""
    bands, nodes, most = taps.shape
    apart = np.zeros((bands, nodes, 2, most + LANES))
    wide = np.empty_like(widths)
    for band in range(bands):
        wide[band] = (widths[band] + LANES - 1) // LANES * LANES
        for node in range(nodes):
            for tap in range(widths[band]):
                apart[band, node, 0, tap] = taps[band, node, tap].real
                apart[band, node, 1, tap] = taps[band, node, tap].imag
    return apart, wide


@njit(cache=True, fastmath=True)
def _turned(angle):
    """Return exp(-1j * angle)."""
    place = angle * (TURNS / (2 * np.pi))
    node = np.floor(place + 0.5)
    rest = (place - node) * (2 * np.pi / TURNS)
    at = int(node) % TURNS
    square = rest * rest
    cosine = 1.0 - 0.5 * square
    sine = rest * (1.0 - square / 6)
    return complex(
        _COSINE[at] * cosine - _SINE[at] * sine,
        -_SINE[at] * cosine - _COSINE[at] * sine,
    )


@njit(cache=True, fastmath=True)
def bounce(found, away, counts, cosines, bounces):
    """Part reflections into pairs of opposite walls and odd ones.

    `cosines` (3, images) takes the slants, `bounces` (3, 2 + BITS, images) by axis
    whether the low or the high wall is hit once more, and the bits of the pairs.
    Returns the bits in use.
    """
    most = 0
    for n in range(found):
        for axis in range(3):
            cosines[axis, n] = abs(away[n, axis]) / away[n, 3]
            low, high = counts[n, 2 * axis], counts[n, 2 * axis + 1]
            pairs = min(low, high)
            bounces[axis, 0, n] = low - pairs
            bounces[axis, 1, n] = high - pairs
            for bit in range(BITS):
                bounces[axis, 2 + bit, n] = (pairs >> bit) & 1
            most = max(most, pairs)
    bits = 0
    while most > 0:
        most, bits = most // 2, bits + 1
    return bits


@njit(cache=True, fastmath=True)
def _reflect(found, low, high, angled, cosine, bounces, bits, power, out):
    """Multiply all images by what two opposite walls leave; no branch in a loop."""
    total_r, total_i, power_r, power_i = out[0], out[1], power[0], power[1]
    odd_low, odd_high = bounces[0], bounces[1]
    lone = 1.0 if angled else 0.0
    sign = 1.0 - 2.0 * lone
    lr, li, hr, hi = low.real, low.imag, high.real, high.imag
    for n in range(found):
        # a wall's factor is above / below; without an angle it is the wall itself
        c = lone * cosine[n]
        ar, ai, br, bi = c + sign * lr, sign * li, c + sign * hr, sign * hi
        ur, ui = c + lone * lr + 1.0 - lone, lone * li
        vr, vi = c + lone * hr + 1.0 - lone, lone * hi
        first, second = ur * ur + ui * ui, vr * vr + vi * vi
        level = 1.0 / (first * second)
        first, second = second * level, first * level
        ar, ai = (ar * ur + ai * ui) * first, (ai * ur - ar * ui) * first
        br, bi = (br * vr + bi * vi) * second, (bi * vr - br * vi) * second
        power_r[n], power_i[n] = ar * br - ai * bi, ar * bi + ai * br
        x, y = odd_low[n], odd_high[n]
        a, b = 1.0 - x - y + x * ar + y * br, x * ai + y * bi
        real = total_r[n] * a - total_i[n] * b
        total_i[n] = total_r[n] * b + total_i[n] * a
        total_r[n] = real
    for bit in range(bits):
        taken = bounces[2 + bit]
        for n in range(found):
            p, q = power_r[n], power_i[n]
            a, b = 1.0 + taken[n] * (p - 1.0), taken[n] * q
            real = total_r[n] * a - total_i[n] * b
            total_i[n] = total_r[n] * b + total_i[n] * a
            total_r[n] = real
            power_r[n], power_i[n] = p * p - q * q, 2.0 * p * q


@njit(cache=True, fastmath=True)
def place_arrivals(
    found, away, cosines, bounces, bits, walls, angled, loss, scale, latency, turn,
    rate, size, lead, fractions, spare, values, places, parts,
):  # fmt: skip
    """Write the values of images in one band, patterns left out, and their places.

    `places` takes the first envelope sample and the node of the taps, `parts` how far
    behind that node an image stands.
    """
    spare[0, :found], spare[1, :found] = 1.0, 0.0
    for axis in range(3):
        _reflect(
            found, walls[2 * axis], walls[2 * axis + 1], angled, cosines[axis],
            bounces[axis], bits, spare[2:], spare,
        )  # fmt: skip
    for n in range(found):
        length = away[n, 3]
        at = length * scale + latency
        value = complex(spare[0, n], spare[1, n]) * _turned(turn * at)
        values[n] = value * (np.exp(-loss * length) / length)
        place = at * rate
        base = int(np.floor(place))
        fine = (place - base) * fractions
        step = int(fine)
        start = base - lead
        if start < 0 or start >= size:
            start %= size
        places[n, 0], places[n, 1] = start, step
        parts[n] = fine - step


@njit(cache=True, fastmath=True)
def add_arrivals(found, values, places, parts, taps, width, out):
    """Add images to an envelope, shape (2, size and as much as taps may stand out)."""
    for n in range(found):
        start, step, part = places[n, 0], places[n, 1], parts[n]
        a, b = values[n].real, values[n].imag
        low, high = taps[step], taps[step + 1]
        for tap in range(width):
            real = low[0, tap] + part * (high[0, tap] - low[0, tap])
            imag = low[1, tap] + part * (high[1, tap] - low[1, tap])
            out[0, start + tap] += a * real - b * imag
            out[1, start + tap] += a * imag + b * real


@njit(cache=True, fastmath=True)
def heard_arrivals(found, places, parts, taps, width, left, heard):
    """Write what an envelope, continued round its end, holds of each image's shape."""
    for n in range(found):
        start, step, part = places[n, 0], places[n, 1], parts[n]
        low, high = taps[step], taps[step + 1]
        a, b = 0.0, 0.0
        for tap in range(width):
            real = low[0, tap] + part * (high[0, tap] - low[0, tap])
            imag = low[1, tap] + part * (high[1, tap] - low[1, tap])
            now, beside = left[0, start + tap], left[1, start + tap]
            a += real * now + imag * beside
            b += real * beside - imag * now
        heard[n] = complex(a, b)


@njit(cache=True, fastmath=True)
def folded(out, size):
    """Bring what stands out behind an envelope's end back to its start."""
    for m in range(size, out.shape[1]):
        for half in range(2):
            out[half, m % size] += out[half, m]
            out[half, m] = 0.0
