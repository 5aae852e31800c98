"""Exact diffraction at a rigid wedge, after Biot, Tolstoy and Medwin.

Slow and exact: what `rooms.diffraction.utd` is checked against.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["wedge_pressure"]

_POINTS = 40001


def wedge_pressure(
    opening: float,
    emitter: tuple[float, float, float],
    listener: tuple[float, float, float],
    frequencies: ArrayLike,
    speed_of_sound: float,
    *,
    reach: float = 400.0,
) -> NDArray[np.complex128]:
    """Return the pressure diffracted by a long rigid wedge; free field is 1/d.

    Parameters
    ----------
    opening : float
        Angle of the air [rad].
    emitter, listener : tuple
        Distance from the edge [m], angle from the first face [rad], and place along
        the edge [m].
    frequencies : array_like, shape (n,)
        Frequencies [Hz].
    speed_of_sound : float
        Speed of sound [m/s].
    reach : float
        Distance along the edge at which the integral has faded out [m].

    Returns
    -------
    ndarray, shape (n,)

    References
    ----------
    U. P. Svensson, R. I. Fred, J. Vanderkooy, JASA 106, 2331 (1999), equations 5, 6.
    """
    nu = np.pi / opening
    (rs, ts, zs), (rr, tr, zr) = emitter, listener
    apex = (zs * rr + zr * rs) / (rs + rr)
    # close steps at the apex, where the integrand peaks near shadow boundaries
    narrow = 1e-4 * (rs + rr)
    end = np.arcsinh(reach / narrow)
    u = np.linspace(-end, end, _POINTS)
    z, weight = apex + narrow * np.sinh(u), narrow * np.cosh(u) * (u[1] - u[0])
    fade = np.clip((reach - np.abs(z - apex)) / (0.9 * reach), 0, 1)
    weight *= np.sin(np.pi / 2 * fade) ** 2
    m, way = np.hypot(rs, z - zs), np.hypot(rr, z - zr)
    stretch = (m * way + (z - zs) * (z - zr)) / (rs * rr)
    eta = np.arccosh(np.maximum(stretch, 1.0))
    beta = np.zeros_like(z)
    for phi in (np.pi + ts + tr, np.pi + ts - tr, np.pi - ts + tr, np.pi - ts - tr):
        beta += np.sin(nu * phi) / (np.cosh(nu * eta) - np.cos(nu * phi))
    k = 2 * np.pi * np.asarray(frequencies, dtype=float) / speed_of_sound
    waves = np.exp(-1j * k[:, None] * (m + way))
    return -nu / (4 * np.pi) * waves @ (beta * weight / (m * way))
