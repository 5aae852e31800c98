"""Turn a grid of moments into samples: the pulse shape of every arrival."""

from functools import lru_cache

import numpy as np
from numba import njit

from rooms.kernels.deposit import MOMENTS

HALF_TAPS = 18
_BETA = 11.0
_BLOCK = 256


@lru_cache(maxsize=1)
def pulse_bank():
    """Return the filter bank, shape (moments, taps).

    Tap k of a row belongs to sample row + k + 1 - taps / 2.

    Each tap of a Kaiser-windowed sinc is a smooth function of the fraction; the
    bank holds its best polynomial in x = 2f - 1 (interpolation at Chebyshev
    nodes). Up to 0.8 of the Nyquist frequency a pulse differs from an exactly
    delayed one by less than -100 dB.
    """
    nodes = np.cos(np.pi * (np.arange(64) + 0.5) / 64)
    fraction = (nodes + 1) / 2
    taps = np.arange(1 - HALF_TAPS, HALF_TAPS + 1)
    offset = taps[:, None] - fraction
    inside = np.clip(1 - (offset / HALF_TAPS) ** 2, 0, None)
    pulse = np.sinc(offset) * np.i0(_BETA * np.sqrt(inside)) / np.i0(_BETA)
    chebyshev = np.polynomial.chebyshev.chebfit(nodes, pulse.T, MOMENTS - 1)
    return np.ascontiguousarray(
        np.array([np.polynomial.chebyshev.cheb2poly(c) for c in chebyshev.T]).T
    )


@njit(cache=True, nogil=True, fastmath=True, inline="always")
def _add_four(out, work, bank, first, tap, width):
    """Add four moments of a block to samples; four streams still vectorise."""
    a, b, c, d = work[first], work[first + 1], work[first + 2], work[first + 3]
    e, f = bank[first, tap], bank[first + 1, tap]
    g, h = bank[first + 2, tap], bank[first + 3, tap]
    for i in range(width):
        out[i] += e * a[i] + f * b[i] + g * c[i] + h * d[i]


@njit(cache=True, nogil=True, fastmath=True)
def shape_pulses(grid, decay, bank, out):
    """Add the pulses of a grid (rows, 8, lanes) to interleaved samples.

    Parameters
    ----------
    grid : ndarray, shape (rows, 8, lanes)
        Moments of the arrivals.
    decay : ndarray, shape (rows, lanes)
        What the air leaves of an arrival at that row.
    bank : ndarray, shape (8, taps)
        See `pulse_bank`.
    out : ndarray, shape ((rows + taps) lanes,)
        Samples, starting taps / 2 - 1 samples before row 0.
    """
    rows, moments, lanes = grid.shape
    block = max(1, _BLOCK // lanes)
    work = np.empty((MOMENTS, block * lanes))
    for start in range(0, rows, block):
        count = min(block, rows - start)
        loudest = 0.0
        for row in range(count):
            for moment in range(moments):
                for lane in range(lanes):
                    value = grid[start + row, moment, lane] * decay[start + row, lane]
                    work[moment, row * lanes + lane] = value
                    loudest = max(loudest, abs(value))
        if loudest == 0.0:
            continue
        width = count * lanes
        for tap in range(bank.shape[1]):
            begin = (start + tap) * lanes
            _add_four(out[begin : begin + width], work, bank, 0, tap, width)
            _add_four(out[begin : begin + width], work, bank, 4, tap, width)
