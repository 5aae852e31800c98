"""The harmonics of `rir.harmonics`, for compiled loops over single directions.

They are inlined, so that they follow the loop's own rules of floating point.
"""

from math import pi, sqrt

from numba import njit

__all__ = ["fill_harmonics", "order_of", "turned_harmonics"]


@njit(cache=True, nogil=True)
def order_of(count):
    """Return the order whose harmonics number `count`."""
    return int(sqrt(count) + 0.5) - 1


@njit(inline="always")
def fill_harmonics(x, y, z, order, out):
    """Write the harmonics of a unit vector, up to `order`, into `out`."""
    real, imag, diagonal, double = 1.0, 0.0, 1.0, 1.0
    for m in range(order + 1):
        before, legendre, ratio = 0.0, diagonal, double
        for degree in range(m, order + 1):
            if degree > m:
                upper = (2 * degree - 1) * z * legendre - (degree + m - 1) * before
                before, legendre = legendre, upper / (degree - m)
                ratio *= (degree - m) / (degree + m)
            norm = sqrt((2 if m else 1) * (2 * degree + 1) * ratio / (4 * pi))
            center = degree * degree + degree
            out[center + m] = norm * legendre * real
            if m:
                out[center - m] = norm * legendre * imag
        real, imag = real * x - imag * y, real * y + imag * x
        diagonal *= 2 * m + 1
        double /= (2 * m + 1) * (2 * m + 2)


@njit(inline="always")
def turned_harmonics(turn, x, y, z, order, out):
    """Write the harmonics of a direction that `turn` takes into a device's frame."""
    a = turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z
    b = turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z
    c = turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z
    fill_harmonics(a, b, c, order, out)
