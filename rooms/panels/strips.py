"""The rigid strip: how much of a plane wave it mirrors, exactly.

A strip much narrower than a wavelength mirrors far less than its area promises: the
pressures before and behind it even out around its edges. What remains is found from
the boundary integral of a thin rigid strip, once, and looked up.
"""

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from rir.arrays import ComplexArray, FloatArray

__all__ = ["first_order", "strip_mean", "strip_table"]

_NARROWEST, _WIDEST = 0.1, 20.0
"""Wavenumber times width, tabulated: below, the mean is proportional to it; above,
the two edges are independent of each other."""
_STEP, _ANGLES = 0.5, 16  # looked up within 0.005, beyond the widest 0.03
_FEWEST = 40  # elements: they keep the static limit within 0.1 %


def first_order(width: FloatArray, sine: FloatArray) -> ComplexArray:
    """Return the mean if waves from one edge did not end at the other.

    Parameters
    ----------
    width : ndarray
        Wavenumber times width.
    sine : ndarray
        Sine of the angle of incidence, 0…1.
    """
    share = 1 / (width * np.maximum(1 - sine**2, 1e-12))
    return 1 - 1j * np.asarray(share, dtype=float)


def strip_mean(width: float, sine: FloatArray) -> ComplexArray:
    """Return the mean pressure over a rigid strip, in units of twice the wave's.

    It is the pressure between front and back, over twice that of the wave, in the
    phase of the wave: 1 for a wide strip, and proportional to the width for a narrow
    one. The strip mirrors this share of the pressure that Kirchhoff's
    approximation has it mirror.

    Parameters
    ----------
    width : float
        Wavenumber times width.
    sine : ndarray, shape (n,)
        Sines of the angles of incidence.

    References
    ----------
    A. Maue, Z. Phys. 126, 601 (1949): the boundary integral. Elements end a quarter
    of their length inside the edges, as doublets on thin wings do (R. James, Comput.
    Methods Appl. Mech. Eng. 1, 59, 1972), which is exact for a still fluid.

    Examples
    --------
    >>> abs(strip_mean(0.01, np.zeros(1))[0] / 0.01).round(3)  # pi / 8
    np.float64(0.393)
    """
    from scipy.special import hankel1

    count = max(_FEWEST, int(3 * width))
    step = 1 / (count + 0.5)
    index = np.arange(-(count - 1), count)
    apart = index * step
    still = 1 / (apart - step / 2) - 1 / (apart + step / 2)

    def rest(distance: FloatArray) -> ComplexArray:
        wave = 0.25j * width * hankel1(1, width * distance) / distance
        return wave - 1 / (2 * np.pi * distance**2)

    far = np.abs(np.where(index == 0, 1.0, apart))
    kernel = still / (2 * np.pi) + step * rest(far)
    # on its own element the rest grows as a logarithm: nodes crowd at the middle
    node, weight = np.polynomial.legendre.leggauss(12)
    place, weight = ((node + 1) / 2) ** 3, 1.5 * weight * ((node + 1) / 2) ** 2
    own = step * (weight @ rest(place * step / 2))
    kernel[count - 1] = still[count - 1] / (2 * np.pi) + own
    rows = np.arange(count)
    matrix = kernel[rows[:, None] - rows + count - 1]
    wave = np.exp(1j * width * np.outer((rows + 0.5) * step, sine))
    drive = 1j * width * np.sqrt(1 - sine**2) * wave
    jump = np.linalg.solve(matrix, drive)
    return np.sum(jump / wave, axis=0) * step / 2


@lru_cache(maxsize=1)
def strip_table() -> Callable[[FloatArray, FloatArray], ComplexArray]:
    """Return a function of width and sine, arrays alike, that looks up `strip_mean`."""
    from scipy.interpolate import RectBivariateSpline

    narrow = np.geomspace(_NARROWEST, 2 * _STEP, 8)
    widths = np.concatenate([narrow, np.arange(3 * _STEP, _WIDEST + _STEP, _STEP)])
    # near grazing the mean goes with the angle, not with its sine
    slant = np.linspace(0.0, 1.0, _ANGLES)
    sines = 1 - slant**2
    rows = np.array([strip_mean(width, sines[1:]) for width in widths])
    rows = np.concatenate([np.zeros((len(widths), 1)), rows], axis=1)
    real, imaginary = (
        RectBivariateSpline(np.log(widths), slant, part)
        for part in (rows.real, rows.imag)
    )

    def look_up(width: FloatArray, sine: FloatArray) -> ComplexArray:
        inside = np.clip(width, _NARROWEST, _WIDEST)
        # wide strips depend on the edge that the wave meets at the flatter angle
        flat = (1 - sine) * width / inside
        at = np.log(inside), np.sqrt(np.minimum(flat, 1))
        mean = real.ev(*at) + 1j * imaginary.ev(*at)
        mutual = mean - first_order(inside, 1 - np.minimum(flat, 1))
        wide = first_order(width, sine) + mutual / np.maximum(flat, 1)
        return np.where(
            width > _WIDEST, wide, mean * np.where(width < inside, width / inside, 1)
        )

    return look_up
