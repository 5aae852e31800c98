"""Fresnel's integrals: beyond an edge, and over a rectangle met along neither side."""

import numpy as np

from rir.arrays import ComplexArray, FloatArray

__all__ = ["beyond", "over_rectangle", "turn"]

_NODES = 8  # of the correlation: more move levels by 0.03 dB, at 80 degrees by 0.2


def turn(detour: FloatArray, wave: FloatArray, cell: FloatArray) -> ComplexArray:
    """Return the phases of detours, shape (n, k).

    In the mean over the frequencies that each one stands for, those of long ones fade.

    Parameters
    ----------
    detour : ndarray, shape (n,)
        How much longer a way is [m].
    wave, cell : ndarray, shape (k,)
        Wavenumbers, and the width of what each stands for [1/m].
    """
    phase = np.exp(1j * np.outer(detour, wave))
    phase *= np.sinc(np.outer(detour, cell) / (2 * np.pi))
    return phase


def beyond(x: FloatArray) -> ComplexArray:
    """Return Fresnel's integral from x to infinity, less its phase: 1/2 at 0."""
    from scipy.special import wofz

    return 0.5 * wofz(np.exp(0.25j * np.pi) * x)


def over_rectangle(
    detour: FloatArray, cross: FloatArray, wave: FloatArray, cell: FloatArray
) -> ComplexArray:
    """Return Fresnel's integral over rectangles around points of reflection, (n, k).

    A way that runs along neither side brings a product of both coordinates into the
    phase. What it changes is a sum over the corners, each an integral over the strength
    of that product, as for two normal variables that are correlated.

    Parameters
    ----------
    detour : ndarray, shape (n, 2, 2)
        How much longer the ways over the ends (low, high) of both sides are, straight
        along the other side of the point of reflection [m].
    cross : ndarray, shape (n,)
        Correlation of both sides, -1…1.
    wave, cell : ndarray, shape (k,)
        See `turn`.

    References
    ----------
    R. Plackett, Biometrika 41, 351 (1954): the derivative by the correlation.
    """
    # over the other side as a whole the detour is least where the way bends
    least = detour * (1 - cross**2)[:, None, None]
    total = np.ones((len(detour), len(wave)), dtype=np.complex128)
    for side in (0, 1):
        low, high = (
            turn(one, wave, cell) * beyond(np.sqrt(np.outer(one, wave)))
            for one in least[:, side].T
        )
        total *= 1 - low - high
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    angle = np.arcsin(cross)
    for node, weight in zip((nodes + 1) / 2, weights / 2, strict=True):
        part = np.sin(node * angle)
        for end in (0, 1):
            for other in (0, 1):
                x, y = least[:, 0, end], least[:, 1, other]
                sign = 1 if end == other else -1
                way = (x + y - 2 * sign * part * np.sqrt(x * y)) / (1 - part**2)
                share = sign * weight * angle / (2 * np.pi)
                total += share[:, None] * turn(way, wave, cell)
    return total
