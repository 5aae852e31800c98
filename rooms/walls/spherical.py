"""Reflection of a spherical wave: near grazing it is no plane wave's."""

import numpy as np

from rir.arrays import ComplexArray, FloatArray
from rir.walls import WallModel

__all__ = ["spherical_factor"]


def spherical_factor(
    wall: WallModel,
    frequencies: FloatArray,
    cosines: FloatArray,
    lengths: FloatArray,
    speed_of_sound: float,
) -> ComplexArray:
    """Return what is left of a spherical wave's pressure, shape (n, frequencies).

    Q = R + (1 - R) F(w) with the plane wave's factor R, the numerical distance
    w² = -j k r (β + cos θ)² / 2 and F(w) = 1 + j √π w e^(-w²) erfc(-j w).

    Parameters
    ----------
    wall : WallModel
        The wall.
    frequencies : ndarray, shape (frequencies,)
        Frequencies [Hz].
    cosines, lengths : ndarray, shape (n,)
        Cosine of the angle of incidence, and the way from end to end [m].
    speed_of_sound : float
        Speed of sound [m/s].

    References
    ----------
    C. F. Chien, W. W. Soroka, J. Sound Vib. 43, 9 (1975); K. Attenborough, S. Hayek,
    J. Lawther, JASA 68, 1493 (1980).
    """
    from scipy.special import wofz

    # exactly along the wall all but a rigid one cancel the pressure
    cosine = np.maximum(cosines, 1e-9)[:, None]
    if wall.locally_reacting:
        beta = wall.admittance(frequencies, np.ones(1))[None]
    else:
        beta = wall.admittance(frequencies, cosine)
    plane = (cosine - beta) / (cosine + beta)
    phase = np.pi * frequencies / speed_of_sound * lengths[:, None]
    # the other sign of time, in which the function is tabulated
    w = np.sqrt(1j * phase) * (np.conj(beta) + cosine)
    loss = 1 + 1j * np.sqrt(np.pi) * w * wofz(w)
    return plane + (1 - plane) * np.conj(loss)
