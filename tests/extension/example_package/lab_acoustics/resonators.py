"""A wall model: small resonators that cover a share of a rigid wall."""

from typing import Annotated

import numpy as np
from pydantic import Field

from rir.arrays import ComplexArray, FloatArray
from rir.config import StrictModel
from rir.walls import WallKind


class Resonators(StrictModel):
    """Resonators of one frequency, quality and resistance; each reacts on its own."""

    frequency_hz: Annotated[float, Field(gt=0)]
    quality: Annotated[float, Field(gt=0)] = 5.0
    covered: Annotated[float, Field(gt=0, le=1)] = 0.5

    @property
    def locally_reacting(self) -> bool:
        """Always."""
        return True

    def admittance(self, frequencies: FloatArray, cosines: FloatArray) -> ComplexArray:
        """Return the admittance, ρc v/p; time goes as e^(+jωt)."""
        f, _ = np.broadcast_arrays(frequencies, cosines)
        detuned = f / self.frequency_hz - self.frequency_hz / f
        return np.asarray(self.covered / (1 + 1j * self.quality * detuned), complex)


RESONATORS = WallKind(
    "resonators", "resonators on a wall", Resonators, {"frequency_hz": 200.0}
)
