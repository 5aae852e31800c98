"""What every model of a wall answers."""

from typing import Protocol, runtime_checkable

from rir.arrays import ComplexArray, FloatArray

__all__ = ["WallModel"]


@runtime_checkable
class WallModel(Protocol):
    """A flat wall that answers plane waves with an admittance.

    The admittance is specific: velocity into the wall over pressure, times the
    characteristic impedance of air. Time goes as e^(+jωt), so a mass has an impedance
    +jωm and a stiff air gap a positive imaginary admittance.
    """

    @property
    def locally_reacting(self) -> bool:
        """Whether each point answers its own pressure only, whatever the angle."""
        ...

    def admittance(self, frequencies: FloatArray, cosines: FloatArray) -> ComplexArray:
        """Return the admittance at frequencies [Hz] and cosines of incidence.

        The two broadcast against each other; the real part is never negative.
        """
        ...
