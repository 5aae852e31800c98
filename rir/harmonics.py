"""Real spherical harmonics: orthonormal, in ACN order.

A function on the sphere is a row of coefficients c, f(u) = sum_k c_k Y_k(u),
with k = l^2 + l + m. Orthonormal means that the integral of Y_k^2 over the
sphere is 1, so Y_0 = 1/sqrt(4 pi). There is no Condon-Shortley phase: Y_1 is
sqrt(3/4pi) times (y, z, x).
"""

from functools import lru_cache
from math import factorial, pi, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir.errors import SignalError

__all__ = ["evaluate_harmonics", "harmonic_count", "harmonic_order"]


def harmonic_count(order: int) -> int:
    """Return the number of harmonics up to and including `order`."""
    return (order + 1) ** 2


def harmonic_order(count: int) -> int:
    """Return the order whose harmonics number `count`.

    Raises
    ------
    SignalError
        If `count` is not a square.
    """
    order = round(sqrt(count)) - 1
    if harmonic_count(order) != count:
        raise SignalError(f"{count} coefficients do not fill an order (1, 4, 9, 16, …)")
    return order


@lru_cache(maxsize=256)
def _norm(degree: int, m: int) -> float:
    ratio = factorial(degree - m) / factorial(degree + m)
    return sqrt((2 if m else 1) * (2 * degree + 1) / (4 * pi) * ratio)


def evaluate_harmonics(directions: ArrayLike, order: int) -> NDArray[np.float64]:
    """Evaluate all real harmonics up to `order`.

    Parameters
    ----------
    directions : array_like, shape (..., 3)
        Unit vectors.
    order : int
        Highest degree.

    Returns
    -------
    ndarray, shape (..., (order + 1)^2)

    Notes
    -----
    Built from Cartesian recursions, so the poles need no special case:
    cos(m phi) sin^m(theta) and sin(m phi) sin^m(theta) follow from (x + iy)^m,
    and the associated Legendre factors without sin^m(theta) from
    (l-m) P_lm = (2l-1) z P_(l-1)m - (l+m-1) P_(l-2)m.

    Examples
    --------
    >>> evaluate_harmonics([0.0, 0.0, 1.0], 1).round(4).tolist()
    [0.2821, 0.0, 0.4886, 0.0]
    """
    u = np.asarray(directions, dtype=float)
    x, y, z = u[..., 0], u[..., 1], u[..., 2]
    values = np.empty((*u.shape[:-1], harmonic_count(order)))
    planar = np.ones_like(x) + 0j
    diagonal = 1.0
    for m in range(order + 1):
        before, legendre = np.zeros_like(z), np.full_like(z, diagonal)
        for degree in range(m, order + 1):
            if degree > m:
                upper = (2 * degree - 1) * z * legendre - (degree + m - 1) * before
                before, legendre = legendre, upper / (degree - m)
            scaled = _norm(degree, m) * legendre
            center = degree * degree + degree
            values[..., center + m] = scaled * np.real(planar)
            if m:
                values[..., center - m] = scaled * np.imag(planar)
        planar = planar * (x + 1j * y)
        diagonal *= 2 * m + 1
    return values
