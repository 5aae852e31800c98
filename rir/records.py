"""What was measured, where it came from, and in which air."""

from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

from rir.errors import DatasetError
from rir.gain import GainPattern
from rir.physics import speed_of_sound
from rir.pose import Pose
from rir.response import ImpulseResponse

__all__ = ["Environment", "Measurement", "PairRecord", "Provenance", "software_version"]


@cache
def software_version() -> str:
    """Return the name and version of this program, as written into files."""
    try:
        return f"resounding {version('resounding')}"
    except PackageNotFoundError:
        return "resounding (not installed)"


@dataclass(frozen=True)
class Environment:
    """State of the air during a take; NaN where nothing was measured."""

    temperature_c: float = float("nan")
    humidity_percent: float = float("nan")
    pressure_kpa: float = float("nan")

    @property
    def speed_of_sound(self) -> float:
        """Speed of sound [m/s]; NaN without a temperature."""
        return speed_of_sound(self.temperature_c)


@dataclass(frozen=True)
class Provenance:
    """Where a response comes from.

    Parameters
    ----------
    simulated : bool
        True for anything that no microphone heard.
    source : str
        Device, simulator, session or file it came from.
    software : str
        Program and version.
    detail : dict
        Anything else worth keeping, plain data only.
    """

    simulated: bool
    source: str
    software: str = field(default_factory=software_version)
    detail: dict[str, Any] = field(default_factory=dict)

    @property
    def mark(self) -> str:
        """The word shown wherever the response is shown."""
        return "SIMULATED" if self.simulated else "MEASURED"


@dataclass(frozen=True, eq=False)
class Measurement:
    """One response from one emitter pose to one listener pose."""

    emitter: Pose
    listener: Pose
    response: ImpulseResponse
    provenance: Provenance
    environment: Environment = Environment()
    emitter_gain: GainPattern | None = None
    listener_gain: GainPattern | None = None

    def exchanged(self) -> "Measurement":
        """Return the reciprocal view: poses and gains of both ends swapped."""
        return Measurement(
            self.listener,
            self.emitter,
            self.response,
            self.provenance,
            self.environment,
            self.listener_gain,
            self.emitter_gain,
        )


@dataclass(frozen=True, eq=False)
class PairRecord:
    """Two measurements between the same places, in both directions.

    Parameters
    ----------
    forward, reverse : Measurement
        A to B, and B to A.
    tolerance : float
        Largest distance [m] between places that must coincide.

    Raises
    ------
    DatasetError
        If the places differ by more, with the distance in millimetres.
    """

    forward: Measurement
    reverse: Measurement
    tolerance: float = 0.005

    def __post_init__(self) -> None:
        a = self.forward.emitter.distance(self.reverse.listener)
        b = self.forward.listener.distance(self.reverse.emitter)
        if not max(a, b) <= self.tolerance:
            raise DatasetError(
                f"not a reciprocity pair: the ends differ by {1000 * a:.1f} mm and"
                f" {1000 * b:.1f} mm; at most {1000 * self.tolerance:.1f} mm is allowed"
            )
        if self.forward.response.sample_rate != self.reverse.response.sample_rate:
            raise DatasetError("not a reciprocity pair: the sample rates differ")

    @property
    def temperature_change(self) -> float:
        """Temperature of the reverse take minus that of the forward one [K]."""
        forward, reverse = self.forward.environment, self.reverse.environment
        return reverse.temperature_c - forward.temperature_c

    @property
    def distance(self) -> float:
        """Distance between the ends [m]."""
        return self.forward.emitter.distance(self.forward.listener)

    @property
    def level_difference(self) -> float:
        """Energy of the reverse response re the forward one [dB]; NaN for silence."""
        energies = self.reverse.response.energy, self.forward.response.energy
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(10 * np.log10(energies[0].sum() / energies[1].sum()))
