"""The air of a room."""

from typing import Annotated

from numpy.typing import ArrayLike
from pydantic import Field

from rir.arrays import FloatArray
from rir.config import StrictModel
from rir.physics import (
    REFERENCE_HUMIDITY_PERCENT,
    REFERENCE_PRESSURE_KPA,
    REFERENCE_TEMPERATURE_C,
    air_absorption,
    speed_of_sound,
)

__all__ = ["Air"]


class Air(StrictModel):
    """State of the air."""

    temperature_c: Annotated[float, Field(ge=-40, le=60)] = REFERENCE_TEMPERATURE_C
    humidity_percent: Annotated[float, Field(ge=0, le=100)] = REFERENCE_HUMIDITY_PERCENT
    pressure_kpa: Annotated[float, Field(gt=20, le=120)] = REFERENCE_PRESSURE_KPA

    @property
    def speed_of_sound(self) -> float:
        """Speed of sound [m/s]."""
        return speed_of_sound(self.temperature_c)

    def absorption(self, frequencies: ArrayLike) -> FloatArray:
        """Return the attenuation [dB/m] at frequencies [Hz]; ISO 9613-1."""
        state = (self.temperature_c, self.humidity_percent, self.pressure_kpa)
        return air_absorption(frequencies, *state)
