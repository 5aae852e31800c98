"""What follows from a wall's admittance: reflection, absorption of diffuse sound."""

import numpy as np
from numpy.typing import ArrayLike

from rir.arrays import ComplexArray, FloatArray
from rir.walls.wall_model import WallModel

__all__ = [
    "octave_frequencies",
    "pressure_factor",
    "random_incidence",
    "random_incidence_octaves",
]

_ANGLES = 32
"""Gauss nodes over angles: smooth integrands, 16 differ by less than 0.0001."""

_PER_OCTAVE = 24
"""Frequencies in an octave: resonances of undamped panels are wider than that."""


def pressure_factor(
    wall: WallModel, frequencies: ArrayLike, cosines: ArrayLike
) -> ComplexArray:
    """Return the factor of the pressure that a plane wave keeps when it is reflected.

    R = (cos θ - β) / (cos θ + β) with the admittance β at angle θ (H. Kuttruff, Room
    Acoustics, 6th ed. 2016, equation 2.17).

    Parameters
    ----------
    wall : WallModel
        The wall.
    frequencies, cosines : array_like
        Frequencies [Hz] and cosines of the angle of incidence, broadcast.

    Examples
    --------
    >>> from rir.walls.admittance import Admittance
    >>> wall = Admittance(conductance=0.5)
    >>> pressure_factor(wall, 1000.0, [1.0, 0.5, 0.25]).real.round(3).tolist()
    [0.333, 0.0, -0.333]
    """
    f, cosine = np.broadcast_arrays(
        np.asarray(frequencies, float), np.asarray(cosines, float)
    )
    # exactly along the wall all but a rigid one cancel the pressure
    cosine = np.maximum(cosine, 1e-9)
    admittance = wall.admittance(f, cosine)
    return (cosine - admittance) / (cosine + admittance)


def random_incidence(wall: WallModel, frequencies: ArrayLike) -> FloatArray:
    """Return the absorption of diffuse sound at frequencies [Hz], in their shape.

    Paris' integral of the absorption at each angle, 2 cos θ sin θ dθ (Kuttruff,
    equation 2.53).

    Examples
    --------
    >>> from rir.walls.admittance import Admittance
    >>> wall = Admittance(conductance=1 / 1.567)
    >>> random_incidence(wall, [1000.0]).round(3).tolist()
    [0.951]
    """
    nodes, weights = np.polynomial.legendre.leggauss(_ANGLES)
    # the cosine is the square of what the nodes stand for: denser at grazing
    root = (nodes + 1) / 2
    cosine, share = root**2, 2 * weights * root**3
    f = np.asarray(frequencies, float)
    kept = np.abs(pressure_factor(wall, f[..., None], cosine)) ** 2
    return (1 - kept) @ share


def octave_frequencies(centers: ArrayLike, count: int = _PER_OCTAVE) -> FloatArray:
    """Return frequencies that fill octaves evenly [Hz], shape (octaves, count).

    Evenly in hertz, as the energy of an impulse does.
    """
    low = np.asarray(centers, float)[..., None] / np.sqrt(2)
    return low * (1 + (np.arange(count) + 0.5) / count)


def random_incidence_octaves(wall: WallModel, centers: ArrayLike) -> FloatArray:
    """Return the absorption of diffuse sound per octave, shape (octaves,)."""
    means = random_incidence(wall, octave_frequencies(centers)).mean(axis=-1)
    return np.clip(means, 0.0, 1.0)
