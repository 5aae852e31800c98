"""What two places exchange by way of scattering surfaces.

Energy that is scattered at least once arrives by mirrors at the last surface that
scatters it on its way to a place. So a patch hands on the energy that met it on any
way from one place, times what would meet it from the other by mirrors only:
scattered (1 - absorption) / (pi area) times both, delays added. Every ray of one
place thus meets every ray of the other.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["Flux", "exchanged", "transformed"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Flux:
    """Energy that meets the patches from one place, per batch of rays.

    Parameters
    ----------
    mirrored, scattered : list of ndarray, shape (patches, frequencies, bands)
        Transforms over time of what came by mirrors only, and of what had been
        scattered on the way.
    """

    mirrored: list[ComplexArray]
    scattered: list[ComplexArray]


def transformed(flux: NDArray[np.float32], scale: float) -> ComplexArray:
    """Return the transform over time of a scaled flux, shape (patches, bins, bands)."""
    from scipy.fft import next_fast_len, rfft

    length = next_fast_len(2 * flux.shape[1], real=True)
    return np.asarray(rfft(np.multiply(flux, scale, dtype=float), length, axis=1))


def exchanged(here: Flux, there: Flux, share: FloatArray, bins: int) -> FloatArray:
    """Return the energy two places exchange, one row for each batch of both.

    Every batch meets all others but its like, since the rays of two places may be
    the same. Exchanging the places changes nothing, to the last bit.

    Parameters
    ----------
    here, there : Flux
        Two or more batches from both places.
    share : ndarray, shape (patches, bands)
        What a patch hands on.
    bins : int
        Number of time steps.

    Returns
    -------
    ndarray, shape (batches, bins, bands)
    """
    from scipy.fft import irfft, next_fast_len

    batches = len(here.mirrored)
    sums = np.zeros((batches, *here.mirrored[0].shape[1:]), dtype=complex)
    rest = np.zeros_like(sums[0])
    for one, others in ((here, there), (there, here)):
        mirrored, scattered = sum(others.mirrored), sum(others.scattered)
        for k in range(batches):
            left = mirrored - others.mirrored[k], scattered - others.scattered[k]
            rest[:] = 0.0
            _meet(one.mirrored[k], one.scattered[k], *left, share, rest)
            sums[k] += rest / (2 * (batches - 1))
    length = next_fast_len(2 * bins, real=True)
    rows = np.asarray(irfft(sums, length, axis=1))[:, :bins]
    # the delays of two bins add to one bin or the next
    rows[:, 1:] = (rows[:, 1:] + rows[:, :-1]) / 2
    rows[:, 0] /= 2
    return rows


@njit(cache=True, nogil=True)
def _meet(mirrored, scattered, back_mirrored, back_scattered, share, total):
    patches, steps, bands = mirrored.shape
    for p in range(patches):
        for f in range(steps):
            for b in range(bands):
                one, other = mirrored[p, f, b], back_mirrored[p, f, b]
                either = scattered[p, f, b] * other + one * back_scattered[p, f, b]
                total[f, b] += share[p, b] * (one * other + 0.5 * either)
