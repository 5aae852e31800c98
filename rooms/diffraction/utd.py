"""Uniform theory of diffraction at a wedge."""

import numpy as np
from numpy.typing import ArrayLike

from rir.arrays import ComplexArray, FloatArray

__all__ = ["diffraction_coefficient", "transition"]

_NEAR = 1e-6  # rad: closer, the product of a pole and a zero is put at its limit


def transition(x: ArrayLike) -> ComplexArray:
    """Return the transition function F(x) of UTD, x >= 0.

    Examples
    --------
    >>> abs(transition(100.0)).round(3)
    np.float64(1.0)
    """
    from scipy.special import wofz

    root = np.sqrt(np.asarray(x, dtype=float))
    return (
        np.sqrt(np.pi)
        * np.exp(0.25j * np.pi)
        * root
        * wofz(np.exp(0.75j * np.pi) * root)
    )


def _term(
    sign: float, angle: FloatArray, n: FloatArray, k: FloatArray, spread: FloatArray
) -> ComplexArray:
    """Return one cotangent times its transition function.

    `angle` is the sum or difference of the two angles around the edge.
    """
    turns = np.round((angle + sign * np.pi) / (2 * np.pi * n))
    a = 2 * np.cos((2 * np.pi * n * turns - angle) / 2) ** 2
    half = (np.pi + sign * angle) / (2 * n)
    # distance from the shadow boundary, where cotangent and F balance
    off = np.pi * sign + angle - 2 * np.pi * n * turns
    near = np.abs(off) < _NEAR
    cot = 1 / np.tan(np.where(near, 1.0, half))
    far = cot * transition(k * spread * a)
    side = np.where(off * sign >= 0, 1.0, -1.0)
    phase = np.exp(0.25j * np.pi)
    small = np.abs(off)
    limit = (
        n * (np.sqrt(2 * np.pi * k * spread) - 2 * k * spread * small * phase) * phase
    )
    return np.where(near, side * limit, far)


def diffraction_coefficient(
    opening: ArrayLike,
    one: ArrayLike,
    other: ArrayLike,
    sine: ArrayLike,
    spread: ArrayLike,
    wavenumber: ArrayLike,
    reflection: tuple[ArrayLike, ArrayLike] = (1.0, 1.0),
) -> ComplexArray:
    """Return the diffraction coefficient D of a wedge [sqrt(m)].

    Parameters
    ----------
    opening : array_like
        Angle of the air around the edge [rad].
    one, other : array_like
        Angles of the two ends, from the first face [rad]; exchangeable.
    sine : array_like
        Sine of the angle between ray and edge.
    spread : array_like
        Distance parameter L = s s' sin² / (s + s') [m].
    wavenumber : array_like
        2 pi f / c [1/m].
    reflection : tuple of array_like
        Reflection factors of the first and second face; 1 is rigid.

    References
    ----------
    R. Kouyoumjian, P. Pathak, Proc. IEEE 62, 1448 (1974), equations 25 to 34, hard
    case; R. Luebbers, IEEE Trans. Antennas Propag. 32, 70 (1984): reflection factors.
    """
    n = np.asarray(opening, dtype=float) / np.pi
    a, b = np.asarray(one, dtype=float), np.asarray(other, dtype=float)
    k, length = np.asarray(wavenumber, dtype=float), np.asarray(spread, dtype=float)
    first, second = (np.asarray(r) for r in reflection)
    # the difference enters with both signs, so that exchanging ends changes nothing
    apart = np.abs(a - b)
    straight = _term(1.0, apart, n, k, length) + _term(-1.0, apart, n, k, length)
    mirrored = second * _term(1.0, a + b, n, k, length)
    mirrored = mirrored + first * _term(-1.0, a + b, n, k, length)
    scale = -np.exp(-0.25j * np.pi) / (2 * n * np.sqrt(2 * np.pi * k))
    return scale / np.asarray(sine) * (straight + mirrored)
