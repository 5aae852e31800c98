"""Compiled kernel of the tail's plane waves."""

import numpy as np
from numba import njit

__all__ = ["add_waves"]


@njit(cache=True)
def add_waves(first, second, starts, signs, leaving, arriving, onset, out):
    """Add plane waves and their twins to rows of samples.

    `first` and `second` are ends in samples of travel, (rows, 3); a wave starts at
    `starts`, leaves along `leaving` and arrives along `arriving`. Its twin does so
    the other way round, and both are added in order of time, so that swapped ends
    give the same bits.
    """
    rows, length = out.shape
    for row in range(rows):
        x, y = first[row], second[row]
        for wave in range(len(starts)):
            u, v = leaving[wave], arriving[wave]
            ux = u[0] * x[0] + u[1] * x[1] + u[2] * x[2]
            vy = v[0] * y[0] + v[1] * y[1] + v[2] * y[2]
            vx = v[0] * x[0] + v[1] * x[1] + v[2] * x[2]
            uy = u[0] * y[0] + u[1] * y[1] + u[2] * y[2]
            one = starts[wave] + (ux + vy)
            other = starts[wave] + (vx + uy)
            early, late = min(one, other), max(one, other)
            for turn in range(2):
                time = early if turn == 0 else late
                place = int(np.floor(time))
                if time < onset[row] or place + 1 >= length:
                    continue
                part = time - place
                out[row, place] += signs[wave] * (1 - part)
                out[row, place + 1] += signs[wave] * part
