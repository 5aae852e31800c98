"""Turn a grid of moments into samples: the pulse shape of every arrival."""

from functools import lru_cache

import numpy as np
from numba import njit

from rooms.kernels.deposit import LANES, MOMENTS

TAPS = 36  # exact to -100 dB up to 0.8 of the Nyquist frequency, see `pulse_bank`
LEAD = TAPS // 2 - 1
"""Samples that the longest pulse begins before its row."""

_BETA = 11.0  # of the Kaiser window: side lobes near -108 dB
_BLOCK = 512  # rows at a time: 8 moments of them fit the first cache
_APART = 16  # a cache line more, so that blocks do not compete for places in the cache
_NARROW, _MEDIUM = 0.13, 0.5
"""Shares of the Nyquist frequency up to which 8 taps and 14 taps are exact enough."""

_COARSE = 4, 24
"""Moments and taps of the bank that stands for the full one where little is asked: its
error is -57, -53, -40 and -31 dB at 0.25, 0.5, 0.8 and 0.9 of the Nyquist frequency."""
_REACH = 0.9  # share of the Nyquist frequency up to which it is fitted


@lru_cache(maxsize=1)
def pulse_bank():
    """Return the filter bank of a pulse that keeps all frequencies.

    Each tap of a Kaiser-windowed sinc is a smooth function of the fraction; the
    bank, shape (moments, taps), holds its best polynomial in x = 2f - 1
    (interpolation at Chebyshev nodes). Up to 0.8 of the Nyquist frequency a pulse
    differs from an exactly delayed one by less than -100 dB.
    """
    nodes = np.cos(np.pi * (np.arange(64) + 0.5) / 64)
    offset = np.arange(-LEAD, TAPS - LEAD)[:, None] - (nodes + 1) / 2
    inside = np.clip(1 - (2 * offset / TAPS) ** 2, 0, None)
    pulse = np.sinc(offset) * np.i0(_BETA * np.sqrt(inside)) / np.i0(_BETA)
    chebyshev = np.polynomial.chebyshev.chebfit(nodes, pulse.T, MOMENTS - 1)
    powers = [np.polynomial.chebyshev.cheb2poly(column) for column in chebyshev.T]
    return np.ascontiguousarray(np.array(powers).T)


def band_bank(share: float, taps: int, moments: int):
    """Return a short bank that is exact up to a share of the Nyquist frequency only.

    Low octaves need few taps and moments: what a bank does above the octave is
    removed by the octave's filter. Least squares over frequency and fraction.
    """
    omega = np.pi * share * (np.arange(48) + 0.5) / 48
    x = np.cos(np.pi * (np.arange(24) + 0.5) / 24)
    tap = np.arange(taps) - (taps // 2 - 1)
    waves = np.exp(-1j * omega[:, None] * tap)
    powers = x[:, None] ** np.arange(moments)
    design = np.einsum("wt,xm->wxmt", waves, powers).reshape(-1, moments * taps)
    goal = np.exp(-1j * omega[:, None] * (x + 1) / 2).reshape(-1)
    stacked = np.concatenate([np.real(design), np.imag(design)])
    target = np.concatenate([np.real(goal), np.imag(goal)])
    # the small ridge keeps the gain above the octave bounded
    ridge = 1e-6 * np.eye(moments * taps)
    rows, right = np.vstack([stacked, ridge]), np.pad(target, (0, moments * taps))
    bank = np.linalg.lstsq(rows, right, rcond=None)[0].reshape(moments, taps)
    return np.ascontiguousarray(bank)


@lru_cache(maxsize=16)
def lane_banks(centers: tuple[float, ...], sample_rate: int, most: int = MOMENTS):
    """Return one bank per band, padded to (lanes, moments, TAPS), and their sizes.

    Parameters
    ----------
    centers : tuple of float
        Octave centres [Hz].
    sample_rate : int
        Samples per second [Hz].
    most : int
        Moments that are known: 8, or 4 for coarser pulses.

    Returns
    -------
    banks : ndarray, shape (lanes, MOMENTS, TAPS)
        Taps aligned so that tap LEAD belongs to the row itself.
    sizes : ndarray, shape (lanes, 3)
        Moments, first tap, one past the last tap of each band.
    """
    banks = np.zeros((len(centers), MOMENTS, TAPS), dtype=np.float32)
    sizes = np.empty((len(centers), 3), dtype=np.int64)
    full, short = pulse_bank(), {}
    for lane, center in enumerate(centers):
        share = 2 * center / (sample_rate / 2)
        last = lane == len(centers) - 1
        kind = (4, 8) if share < _NARROW else (8, 14) if share < _MEDIUM else None
        if last or kind is None:
            if most == MOMENTS:
                banks[lane], sizes[lane] = full, (MOMENTS, 0, TAPS)
                continue
            kind = _COARSE
        moments, taps = min(kind[0], most), kind[1]
        if kind not in short:
            limit = {8: _NARROW, 14: _MEDIUM, _COARSE[1]: _REACH}[taps]
            short[kind] = band_bank(limit, taps, moments)
        first = LEAD - (taps // 2 - 1)
        banks[lane, :moments, first : first + taps] = short[kind]
        sizes[lane] = moments, first, first + taps
    return banks, sizes


@njit(cache=True, nogil=True, fastmath=True)
def _add_four(out, work, bank, first, tap, width):
    """Add four moments of a block to samples; four streams still vectorise."""
    a, b, c, d = work[first], work[first + 1], work[first + 2], work[first + 3]
    e, f = bank[first, tap], bank[first + 1, tap]
    g, h = bank[first + 2, tap], bank[first + 3, tap]
    for i in range(width):
        out[i] += e * a[i] + f * b[i] + g * c[i] + h * d[i]


@njit(cache=True, nogil=True, fastmath=True)
def _sum_four(out, work, bank, first, tap, width):
    """Write the sum over every other moment of a block, from `first` on."""
    a, b, c, d = work[first], work[first + 2], work[first + 4], work[first + 6]
    e, f = bank[first, tap], bank[first + 2, tap]
    g, h = bank[first + 4, tap], bank[first + 6, tap]
    for i in range(width):
        out[i] = e * a[i] + f * b[i] + g * c[i] + h * d[i]


@njit(cache=True, nogil=True, fastmath=True)
def _add_scaled(out, one, other, scale, width):
    for i in range(width):
        out[i] += one[i] + scale * other[i]


@njit(cache=True, nogil=True, fastmath=True)
def _add_folded(out, work, bank, even, odd, width):
    """Add a block through the full bank, two taps at a time.

    Mirrored in time the pulse is the one of -x: taps k and TAPS - 1 - k share the
    sum of the even moments and, up to its sign, that of the odd ones.
    """
    plus, minus = np.float32(1.0), np.float32(-1.0)
    for tap in range(TAPS // 2):
        _sum_four(even, work, bank, 0, tap, width)
        _sum_four(odd, work, bank, 1, tap, width)
        _add_scaled(out[tap : tap + width], even, odd, plus, width)
        other = TAPS - 1 - tap
        _add_scaled(out[other : other + width], even, odd, minus, width)


@njit(cache=True, nogil=True, fastmath=True)
def shape_pulses(grid, decay, banks, sizes, out):
    """Add the pulses of a grid (rows, moments, lanes) to samples (lanes, n).

    Parameters
    ----------
    grid : ndarray, shape (rows, moments, lanes)
        Moments of the arrivals.
    decay : ndarray, shape (rows, lanes)
        What the air leaves of an arrival at that row.
    banks, sizes : ndarray
        See `lane_banks`.
    out : ndarray of float32, shape (lanes, at least rows + TAPS)
        Samples, starting LEAD samples before row 0.

    Notes
    -----
    Arrivals are gathered in double precision; only this last sum over a few
    hundred products is in single precision, which is exact to -130 dB of the
    sound around each sample and more than twice as fast.
    """
    rows = grid.shape[0]
    work = np.empty((MOMENTS, _BLOCK), np.float32)
    even, odd = np.empty(_BLOCK, np.float32), np.empty(_BLOCK, np.float32)
    for lane in range(out.shape[0]):
        moments, low, high = sizes[lane]
        for start in range(0, rows, _BLOCK):
            count = min(_BLOCK, rows - start)
            loudest = np.float32(0.0)
            for row in range(count):
                left = decay[start + row, lane]
                for moment in range(moments):
                    value = grid[start + row, moment, lane] * left
                    work[moment, row] = np.float32(value)
                loudest = max(loudest, abs(work[0, row]))
            if loudest == 0.0:
                continue
            if high - low == TAPS:
                _add_folded(out[lane, start:], work, banks[lane], even, odd, count)
                continue
            for tap in range(low, high):
                samples = out[lane, start + tap : start + tap + count]
                _add_four(samples, work, banks[lane], 0, tap, count)
                if moments > 4:
                    _add_four(samples, work, banks[lane], 4, tap, count)


@njit(cache=True, nogil=True, fastmath=True)
def shape_lanes(grid, decay, banks, sizes, out):
    """Do the same as `shape_pulses` for a grid of eight lanes.

    Lane lies beside lane there, so a block is read once for all of them.
    """
    rows, lanes = grid.shape[0], out.shape[0]
    work = np.empty((LANES, MOMENTS, _BLOCK + _APART), np.float32)
    even, odd = np.empty(_BLOCK, np.float32), np.empty(_BLOCK, np.float32)
    loudest = np.empty(LANES)
    for start in range(0, rows, _BLOCK):
        count = min(_BLOCK, rows - start)
        _take_block(grid[start : start + count], decay[start:], work, loudest)
        for lane in range(lanes):
            moments, low, high = sizes[lane]
            if loudest[lane] == 0.0:
                continue
            if high - low == TAPS:
                samples, some = out[lane, start:], work[lane]
                _add_folded(samples, some, banks[lane], even, odd, count)
                continue
            for tap in range(low, high):
                samples = out[lane, start + tap : start + tap + count]
                _add_four(samples, work[lane], banks[lane], 0, tap, count)
                if moments > 4:
                    _add_four(samples, work[lane], banks[lane], 4, tap, count)


@njit(cache=True, nogil=True, fastmath=True)
def _take_block(grid, decay, work, loudest):
    """Move a block of moments, less what the air takes, to work lane by lane."""
    loudest[:] = 0.0
    for row in range(len(grid)):
        for moment in range(grid.shape[1]):
            for lane in range(LANES):
                value = np.float32(grid[row, moment, lane] * decay[row, lane])
                work[lane, moment, row] = value
        for lane in range(LANES):
            loudest[lane] = max(loudest[lane], abs(grid[row, 0, lane]))
