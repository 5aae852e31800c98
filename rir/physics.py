"""Physical constants and small laws shared by all packages, with sources."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "AIR_DENSITY",
    "AIR_VISCOSITY",
    "REFERENCE_HUMIDITY_PERCENT",
    "REFERENCE_PRESSURE_KPA",
    "REFERENCE_TEMPERATURE_C",
    "STRETCH_PER_KELVIN",
    "ZERO_CELSIUS_K",
    "air_absorption",
    "decibels",
    "speed_of_sound",
]

REFERENCE_TEMPERATURE_C = 20.0  # ISO 9613-1:1993, clause 4
REFERENCE_HUMIDITY_PERCENT = 50.0  # chosen: a room in use; the standard gives none
REFERENCE_PRESSURE_KPA = 101.325  # ISO 9613-1:1993, clause 4
AIR_DENSITY = 1.2041
"""Density of air at 20 °C and 101.325 kPa [kg/m³]: 101325 Pa / (287.05 · 293.15 K)."""
AIR_VISCOSITY = 1.82e-5
"""Viscosity of air at 20 °C [Pa s] (Sutherland; U.S. Standard Atmosphere 1976)."""
ZERO_CELSIUS_K = 273.15  # by definition of the degree Celsius
STRETCH_PER_KELVIN = 0.5 / 293.15
"""Relative change of the speed of sound per kelvin at 20 °C: it grows with sqrt(T)."""


def speed_of_sound(temperature_c: float) -> float:
    """Return the speed of sound in dry air [m/s].

    Parameters
    ----------
    temperature_c : float
        Air temperature [°C].

    References
    ----------
    ISO 9613-1:1993, annex A: c = 343.2 sqrt(T / 293.15) at T kelvin, which is
    331.3 sqrt(1 + t/273.15) at t °C.

    Examples
    --------
    >>> round(speed_of_sound(20.0), 1)
    343.2
    """
    return float(331.3 * np.sqrt(1.0 + temperature_c / ZERO_CELSIUS_K))


def air_absorption(
    frequencies: ArrayLike,
    temperature_c: float = REFERENCE_TEMPERATURE_C,
    humidity_percent: float = REFERENCE_HUMIDITY_PERCENT,
    pressure_kpa: float = REFERENCE_PRESSURE_KPA,
) -> NDArray[np.float64]:
    """Return the pure-tone attenuation of air [dB/m].

    Parameters
    ----------
    frequencies : array_like
        Frequencies [Hz], any shape.
    temperature_c, humidity_percent, pressure_kpa : float
        State of the air [°C, %, kPa].

    References
    ----------
    ISO 9613-1:1993, equations (3) to (5) and annex B.

    Examples
    --------
    >>> [round(1000 * float(a), 2) for a in air_absorption([1000.0, 8000.0])]
    [4.66, 105.29]
    """
    f = np.asarray(frequencies, dtype=float)
    kelvin = temperature_c + ZERO_CELSIUS_K
    warm = kelvin / 293.15
    pressure = pressure_kpa / REFERENCE_PRESSURE_KPA
    saturation = 10.0 ** (-6.8346 * (273.16 / kelvin) ** 1.261 + 4.6151)
    vapour = humidity_percent * saturation / pressure
    oxygen = pressure * (24 + 4.04e4 * vapour * (0.02 + vapour) / (0.391 + vapour))
    thermal = np.exp(-4.170 * (warm ** (-1 / 3) - 1))
    nitrogen = pressure / np.sqrt(warm) * (9 + 280 * vapour * thermal)
    relaxation = 0.01275 * np.exp(-2239.1 / kelvin) / (oxygen + f**2 / oxygen)
    relaxation += 0.1068 * np.exp(-3352.0 / kelvin) / (nitrogen + f**2 / nitrogen)
    classical = 1.84e-11 / pressure * np.sqrt(warm)
    return 8.686 * f**2 * (classical + warm**-2.5 * relaxation)


def decibels(power_ratio: ArrayLike) -> NDArray[np.float64]:
    """Return 10 lg of a power ratio; 0 gives -inf without a warning.

    Examples
    --------
    >>> decibels([1.0, 100.0, 0.0]).tolist()
    [0.0, 20.0, -inf]
    """
    with np.errstate(divide="ignore"):
        return 10.0 * np.log10(np.asarray(power_ratio, dtype=float))
