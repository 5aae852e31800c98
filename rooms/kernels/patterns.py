"""Evaluate gain patterns inside compiled loops."""

from math import sqrt

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def pattern_gains(turn, coefficients, ux, uy, uz, out):
    """Write the gain of each band towards a room direction into `out`.

    The harmonics are those of `rir.harmonics` (orthonormal, ACN, no
    Condon-Shortley phase), by the same recursions.
    """
    lanes, count = coefficients.shape
    order = int(sqrt(count) + 0.5) - 1
    x = turn[0, 0] * ux + turn[0, 1] * uy + turn[0, 2] * uz
    y = turn[1, 0] * ux + turn[1, 1] * uy + turn[1, 2] * uz
    z = turn[2, 0] * ux + turn[2, 1] * uy + turn[2, 2] * uz
    out[:] = 0.0
    real, imag, diagonal, double = 1.0, 0.0, 1.0, 1.0
    for m in range(order + 1):
        before, legendre, ratio = 0.0, diagonal, double
        for degree in range(m, order + 1):
            if degree > m:
                upper = (2 * degree - 1) * z * legendre - (degree + m - 1) * before
                before, legendre = legendre, upper / (degree - m)
                ratio *= (degree - m) / (degree + m)
            norm = sqrt((2 if m else 1) * (2 * degree + 1) * ratio / (4 * np.pi))
            center = degree * degree + degree
            cosine, sine = norm * legendre * real, norm * legendre * imag
            for lane in range(lanes):
                out[lane] += coefficients[lane, center + m] * cosine
                if m:
                    out[lane] += coefficients[lane, center - m] * sine
        real, imag = real * x - imag * y, real * y + imag * x
        diagonal *= 2 * m + 1
        double /= (2 * m + 1) * (2 * m + 2)
