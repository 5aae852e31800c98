"""Compiled: solve the same symmetric systems for many places."""

import numpy as np
from numba import njit

__all__ = ["invert_factor", "meet", "solve"]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def invert_factor(up, down):
    """Write the inverses of triangular factors of symmetric matrices over them.

    A complex matrix is the product of a lower triangle and its transpose, nothing
    conjugated; without pivots, which a matrix of positive real part does not need
    (N. Higham, Mathematics of Computation 67, 1591, 1998).

    Parameters
    ----------
    up, down : ndarray, shape (matrices, n, n)
        Real and imaginary parts of the matrices; then row b holds column b of the
        inverse of the lower triangle.
    """
    count, n = up.shape[0], up.shape[1]
    re, im = np.empty((n, n)), np.empty((n, n))
    for k in range(count):
        a, b = up[k], down[k]
        for j in range(n):
            for m in range(j):
                x, y = a[m, j], b[m, j]
                for i in range(j, n):
                    a[j, i] -= a[m, i] * x - b[m, i] * y
                    b[j, i] -= a[m, i] * y + b[m, i] * x
            pivot = 1.0 / np.sqrt(complex(a[j, j], b[j, j]))
            x, y = pivot.real, pivot.imag
            for i in range(j, n):
                real = a[j, i] * x - b[j, i] * y
                b[j, i] = a[j, i] * y + b[j, i] * x
                a[j, i] = real
        re[:] = 0.0
        im[:] = 0.0
        for j in range(n):
            re[j, j] = 1.0
            for m in range(j, n):
                # one over the diagonal, then what it takes from the rest
                scale = 1.0 / (a[m, m] * a[m, m] + b[m, m] * b[m, m])
                x = (re[j, m] * a[m, m] + im[j, m] * b[m, m]) * scale
                y = (im[j, m] * a[m, m] - re[j, m] * b[m, m]) * scale
                re[j, m], im[j, m] = x, y
                for i in range(m + 1, n):
                    re[j, i] -= a[m, i] * x - b[m, i] * y
                    im[j, i] -= a[m, i] * y + b[m, i] * x
        a[:] = re
        b[:] = im


@njit(cache=True, nogil=True, fastmath=True)
def solve(real, imaginary, given, answers):
    """Apply inverted factors to the columns of many places.

    Parameters
    ----------
    real, imaginary : ndarray, shape (matrices, n, n)
        See `invert_factor`.
    given, answers : ndarray, shape (places, matrices, 2, n)
        Real and imaginary parts; `answers` is zero on entry.
    """
    places, count, _, n = given.shape
    for k in range(count):
        for b in range(n):
            re, im = real[k, b], imaginary[k, b]
            for place in range(places):
                x, y = given[place, k, 0, b], given[place, k, 1, b]
                up, down = answers[place, k, 0], answers[place, k, 1]
                for i in range(b, n):
                    up[i] += re[i] * x - im[i] * y
                    down[i] += re[i] * y + im[i] * x


@njit(cache=True, nogil=True)
def meet(one, other, sign, out):
    """Add to sums the products of two columns, the same for either order.

    Parameters
    ----------
    one, other : ndarray, shape (matrices, 2, n)
        Real and imaginary parts.
    sign : float
        Factor of the products.
    out : ndarray, shape (matrices, 2)
        The sums.

    Notes
    -----
    Not compiled with fast arithmetic: fused products are not the same in either order.
    """
    count, _, n = one.shape
    for k in range(count):
        real, imaginary = 0.0, 0.0
        for i in range(n):
            a, b = one[k, 0, i], one[k, 1, i]
            x, y = other[k, 0, i], other[k, 1, i]
            real += a * x - b * y
            imaginary += a * y + b * x
        out[k, 0] += sign * real
        out[k, 1] += sign * imaginary
