"""Walls of a stated admittance or impedance."""

from collections.abc import Mapping
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, FiniteFloat, field_validator, model_validator

from rir.arrays import ComplexArray, FloatArray
from rir.bands import octave_centers
from rir.config import StrictModel

__all__ = ["MOST_ABSORBED", "Admittance", "Impedance", "real_admittance"]

_CENTERS = octave_centers()
_Values = tuple[FiniteFloat, ...]
_Positive = tuple[Annotated[float, Field(ge=0.0, allow_inf_nan=False)], ...]

MOST_ABSORBED = 0.9512
"""Share of diffuse sound that no real admittance exceeds (Kuttruff, section 2.5)."""

_STIFFEST, _HARDEST = 1 / 1.567, 1e-9
"""Admittances between which the absorption grows: of most and of least absorption."""


def octave_values(values: Any) -> Any:
    """Return numbers as one for all octaves, or as seven from 125 Hz to 8 kHz.

    As `rir.room.per_octave`, for numbers of any size: one; seven; six whose last holds
    at 8 kHz as well; or a mapping from frequency [Hz] to number.
    """
    if isinstance(values, int | float):
        # a wrong number stays single, so that it is told once and not per octave
        return [values]
    if isinstance(values, Mapping):
        try:
            rows = sorted((float(f), float(value)) for f, value in values.items())
            f, value = np.array(rows, dtype=float).T
            over = np.interp(np.log(_CENTERS), np.log(f), value)
        except (TypeError, ValueError):
            return values
        return over.tolist() if np.all(f > 0) else values
    if isinstance(values, list | tuple) and len(values) == len(_CENTERS) - 1:
        return [*values, values[-1]]
    return values


class _ComplexOctaves(StrictModel):
    """Two parts per octave."""

    @field_validator("*", mode="before")
    @classmethod
    def _expand(cls, value: Any) -> Any:
        return octave_values(value)

    @field_validator("*", mode="after")
    @classmethod
    def _whole(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        if len(value) == 1:
            return value * len(_CENTERS)
        if len(value) != len(_CENTERS):
            raise ValueError(
                f"needs 1, 6 or {len(_CENTERS)} values (octaves 125 Hz to 4 or 8 kHz)"
                f" or a mapping from Hz to value, not {len(value)}"
            )
        return value


class Admittance(_ComplexOctaves):
    """A locally reacting wall by its specific admittance (ρc v/p) per octave.

    Between octaves it is interpolated over the logarithm of frequency, beyond them it
    holds. In a room file a plain number is a conductance.

    Examples
    --------
    >>> wall = Admittance(conductance=[0.1, 0.2, 0.3, 0.4, 0.4, 0.4, 0.4])
    >>> wall.admittance(np.array([125.0, 250.0]), np.array(0.5)).tolist()
    [(0.1+0j), (0.2+0j)]
    """

    conductance: _Positive
    susceptance: _Values = (0.0,) * len(_CENTERS)

    @model_validator(mode="before")
    @classmethod
    def _plain(cls, data: Any) -> Any:
        return {"conductance": data} if _is_plain(data) else data

    @property
    def locally_reacting(self) -> bool:
        """Always."""
        return True

    def admittance(self, frequencies: FloatArray, cosines: FloatArray) -> ComplexArray:
        """Return the admittance; the angle does not matter."""
        parts = np.array(self.conductance) + 1j * np.array(self.susceptance)
        return _interpolated(parts, frequencies, cosines)


class Impedance(_ComplexOctaves):
    """A locally reacting wall by its specific impedance (p/(ρc v)) per octave.

    Between octaves it is interpolated over the logarithm of frequency, beyond them it
    holds. In a room file a plain number is a resistance.

    Examples
    --------
    >>> wall = Impedance(resistance=2.0)
    >>> wall.admittance(np.array([125.0]), np.array(0.5)).tolist()
    [(0.5+0j)]
    """

    resistance: _Positive
    reactance: _Values = (0.0,) * len(_CENTERS)

    @model_validator(mode="before")
    @classmethod
    def _plain(cls, data: Any) -> Any:
        return {"resistance": data} if _is_plain(data) else data

    @model_validator(mode="after")
    def _resists(self) -> Self:
        if any(r == 0 and x == 0 for r, x in zip(*self._parts, strict=True)):
            raise ValueError("an impedance of 0 holds no sound; no wall has it")
        return self

    @property
    def _parts(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        return self.resistance, self.reactance

    @property
    def locally_reacting(self) -> bool:
        """Always."""
        return True

    def admittance(self, frequencies: FloatArray, cosines: FloatArray) -> ComplexArray:
        """Return the admittance; the angle does not matter."""
        parts = np.array(self.resistance) + 1j * np.array(self.reactance)
        return 1 / _interpolated(parts, frequencies, cosines)


def _is_plain(data: Any) -> bool:
    """Tell numbers from the names of both parts."""
    if isinstance(data, Mapping):
        return bool(data) and all(isinstance(key, int | float) for key in data)
    return isinstance(data, int | float | list | tuple)


def _interpolated(
    values: ComplexArray, frequencies: FloatArray, cosines: FloatArray
) -> ComplexArray:
    f, _ = np.broadcast_arrays(frequencies, cosines)
    place = np.log(np.maximum(f, 1e-3))
    centers = np.log(_CENTERS)
    real = np.interp(place, centers, values.real)
    return np.asarray(real + 1j * np.interp(place, centers, values.imag))


def real_admittance(absorption: FloatArray) -> FloatArray:
    """Return the hard wall's real admittance that absorbs such shares of diffuse sound.

    Parameters
    ----------
    absorption : ndarray
        Shares of 0 to 0.951; a real admittance absorbs no more.

    Raises
    ------
    ValueError
        If a share is larger.

    Examples
    --------
    >>> real_admittance(np.array([0.0, 0.1, 0.5])).round(4).tolist()
    [0.0, 0.014, 0.1035]
    """
    wanted = np.asarray(absorption, float)
    if np.any(wanted > MOST_ABSORBED):
        raise ValueError(
            f"a locally reacting wall without stiffness or mass absorbs at most"
            f" {MOST_ABSORBED:.3f} of diffuse sound, not {wanted.max():g}; state less,"
            " or its impedance or layers"
        )
    low = np.full(wanted.shape, np.log(_HARDEST))
    high = np.full(wanted.shape, np.log(_STIFFEST))
    for _ in range(60):  # halvings, to the last bit
        middle = (low + high) / 2
        more = _diffuse(np.exp(middle)) > wanted
        low, high = np.where(more, low, middle), np.where(more, middle, high)
    return np.where(wanted > 0, np.exp((low + high) / 2), 0.0)


def _diffuse(admittance: FloatArray) -> FloatArray:
    """Return the absorption of diffuse sound of real admittances (Kuttruff, 2.54)."""
    b = admittance
    with_logs = 1 + 1 / b - 1 / (1 + 1 / b) - 2 * np.log1p(1 / b)
    return 8 * b**2 * with_logs
