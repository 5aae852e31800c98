"""What one image is in one half octave, compiled: its value, its place, its shape."""

import numpy as np
from numba import njit

__all__ = [
    "arrival_arrays",
    "bounce",
    "held_arrivals",
    "paint",
    "place_arrivals",
    "planar",
    "reflected",
    "summed_arrivals",
]

TURNS = 1024
"""Nodes of a turn; between them three terms of the exponential are exact to 1e-11."""
_COSINE = np.cos(2 * np.pi * np.arange(TURNS) / TURNS)
_SINE = np.sin(2 * np.pi * np.arange(TURNS) / TURNS)
LANES = 4  # doubles of a 256-bit register: taps are padded to whole ones
BITS = 8  # of how often a pair of walls is hit: 255 times


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
def arrival_arrays(room_for):
    """Return arrays for what as many images are in one band.

    Slants on the axes; by axis whether the low or the high wall is hit once more, and
    the bits of how often both are; a workspace; values; the first envelope sample and
    the node of the taps; how far behind that node an image stands.
    """
    return (
        np.empty((3, room_for)),
        np.empty((3, 2 + BITS, room_for)),
        np.empty((4, room_for)),
        np.empty(room_for, dtype=np.complex128),
        np.empty((room_for, 2), dtype=np.int64),
        np.empty(room_for),
    )


@njit(cache=True, fastmath=True)
def reflected(wall, angled, cosine):
    """Return the factor of one wall at one slant."""
    return (cosine - wall) / (cosine + wall) if angled else wall


@njit(cache=True, fastmath=True)
def bounce(found, images, arrivals):
    """Part reflections into pairs of opposite walls and odd ones.

    Writes slants and bounces of `arrival_arrays`; returns the bits in use.
    """
    away, counts = images[0], images[2]
    cosines, bounces = arrivals[0], arrivals[1]
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
def place_arrivals(found, bits, band, images, geometry, interior, kernels, arrivals):
    """Write the values of images in one band, patterns left out, and their places."""
    away, walls, loss = images[0], interior.walls[band], interior.loss[band]
    scale, latency = geometry[2], geometry[3]
    turn, rate, size = kernels.turns[band], kernels.rates[band], kernels.lengths[band]
    lead, fractions = kernels.widths[band] // 2 - 1, kernels.taps.shape[1] - 1
    cosines, bounces, spare, values, places, parts = arrivals
    spare[0, :found], spare[1, :found] = 1.0, 0.0
    for axis in range(3):
        _reflect(
            found, walls[2 * axis], walls[2 * axis + 1], interior.angled, cosines[axis],
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
def summed_arrivals(found, arrivals, taps, width, size, out):
    """Write the envelope of all images, shape (2, size and as much as taps stand out).

    What stands out behind the end is brought back to the start and stays as zeros.
    """
    values, places, parts = arrivals[3], arrivals[4], arrivals[5]
    out[:] = 0.0
    for n in range(found):
        start, step, part = places[n, 0], places[n, 1], parts[n]
        a, b = values[n].real, values[n].imag
        low, high = taps[step], taps[step + 1]
        for tap in range(width):
            real = low[0, tap] + part * (high[0, tap] - low[0, tap])
            imag = low[1, tap] + part * (high[1, tap] - low[1, tap])
            out[0, start + tap] += a * real - b * imag
            out[1, start + tap] += a * imag + b * real
    for m in range(size, out.shape[1]):
        for half in range(2):
            out[half, m % size] += out[half, m]
            out[half, m] = 0.0


@njit(cache=True, fastmath=True)
def held_arrivals(found, arrivals, taps, width, size, weight, envelope, held):
    """Write what an envelope, continued round its end, holds of each image's shape."""
    places, parts = arrivals[4], arrivals[5]
    for m in range(size, envelope.shape[1]):
        for half in range(2):
            envelope[half, m] = envelope[half, m % size]
    for n in range(found):
        start, step, part = places[n, 0], places[n, 1], parts[n]
        low, high = taps[step], taps[step + 1]
        a, b = 0.0, 0.0
        for tap in range(width):
            real = low[0, tap] + part * (high[0, tap] - low[0, tap])
            imag = low[1, tap] + part * (high[1, tap] - low[1, tap])
            now, beside = envelope[0, start + tap], envelope[1, start + tap]
            a += real * now + imag * beside
            b += real * beside - imag * now
        held[n] = weight * complex(a, b)


@njit(cache=True, fastmath=True)
def paint(value, at, band, kernels, period, out):
    """Add one arrival at `at` samples to a band's envelope, as far as `out` goes."""
    taps, width = kernels.taps[band], kernels.widths[band]
    place = at * kernels.rates[band]
    base = int(np.floor(place))
    fine = (place - base) * (taps.shape[0] - 1)
    step = int(fine)
    part = fine - step
    m = (base - (width // 2 - 1)) % period
    for tap in range(width):
        wave = taps[step, tap]
        wave += part * (taps[step + 1, tap] - wave)
        if m < len(out):
            out[m] += value * wave
        m += 1
        if m == period:
            m = 0
