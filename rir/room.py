"""A room as data: size, surfaces, air, furniture."""

from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, field_validator, model_validator

from rir.config import Config, load_yaml
from rir.errors import OutOfReachError
from rir.materials import load_materials
from rir.physics import (
    REFERENCE_HUMIDITY_PERCENT,
    REFERENCE_PRESSURE_KPA,
    REFERENCE_TEMPERATURE_C,
    air_absorption,
    octave_centers,
    speed_of_sound,
)

__all__ = ["WALLS", "Air", "Box", "RoomSpec", "Surface"]

FloatArray = NDArray[np.float64]
WALLS = ("x0", "x1", "y0", "y1", "floor", "ceiling")
"""Surfaces of a shoebox in the order of every per-wall array."""

_BANDS = octave_centers(125.0, 8000.0)
_Share = Annotated[float, Field(ge=0.0, le=1.0)]
_Length = Annotated[float, Field(gt=0.0, le=1000.0)]
_Point = tuple[float, float, float]


class Air(Config):
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


class Surface(Config):
    """What one surface does to sound: absorption and scattering per octave.

    Give a `material` of the bundled table, or `absorption` (one number for all
    octaves or seven, 125 Hz to 8 kHz); either may be combined with `scattering`.
    """

    material: str | None = None
    absorption: tuple[_Share, ...] | None = None
    scattering: tuple[_Share, ...] | None = None

    @model_validator(mode="before")
    @classmethod
    def _expand(cls, data: Any) -> Any:
        if isinstance(data, str):
            data = {"material": data}
        if not isinstance(data, dict):
            return data
        return {key: cls._per_octave(key, value) for key, value in data.items()}

    @staticmethod
    def _per_octave(key: str, value: Any) -> Any:
        if key not in ("absorption", "scattering") or not isinstance(
            value, int | float
        ):
            return value
        # A wrong number stays single, so that it is told once and not per octave.
        return [value] * (len(_BANDS) if 0 <= value <= 1 else 1)

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if (self.material is None) == (self.absorption is None):
            raise ValueError("give either a material or absorption, not both or none")
        if self.material is not None and self.material not in load_materials():
            try:
                load_materials()[self.material]
            except KeyError as error:
                raise ValueError(str(error)) from error
        for name, values in (
            ("absorption", self.absorption),
            ("scattering", self.scattering),
        ):
            if values is not None and len(values) != len(_BANDS):
                raise ValueError(
                    f"{name} needs 1 or {len(_BANDS)} values (octaves 125 Hz to 8 kHz),"
                    f" not {len(values)}"
                )
        return self

    def _values(self, name: str, default: float) -> FloatArray:
        given = getattr(self, name)
        if given is None and self.material is not None:
            given = load_materials()[self.material].get(name)
        return (
            np.full(len(_BANDS), default) if given is None else np.array(given, float)
        )

    @property
    def absorption_per_band(self) -> FloatArray:
        """Random-incidence absorption per octave, shape (7,)."""
        return self._values("absorption", 0.0)

    @property
    def scattering_per_band(self) -> FloatArray:
        """Scattering per octave, shape (7,); 0 when nothing is stated."""
        return self._values("scattering", 0.0)


class Box(Config):
    """An axis-aligned box that no device may enter: furniture, say."""

    name: str = "box"
    low: _Point
    high: _Point

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not all(a < b for a, b in zip(self.low, self.high, strict=True)):
            raise ValueError(f"low {self.low} must lie below high {self.high}")
        return self

    def distance(self, point: ArrayLike) -> float:
        """Return the distance of a point to the box [m]; 0 inside."""
        p = np.asarray(point, dtype=float)
        low, high = np.array(self.low), np.array(self.high)
        return float(np.linalg.norm(np.maximum(0, np.maximum(low - p, p - high))))


class RoomSpec(Config):
    """A room: a box of `size_m`, or a mesh, with surfaces, air and furniture.

    The origin is a corner on the floor; x, y, z run along `size_m`.

    Examples
    --------
    >>> walls = {"all": {"absorption": 0.2}}
    >>> room = RoomSpec(name="box", size_m=(6, 5, 3), surfaces=walls)
    >>> float(room.eyring_t60(air=False)[0].round(3))
    0.515
    """

    name: str
    size_m: tuple[_Length, _Length, _Length]
    surfaces: dict[str, Surface] = Field(default_factory=dict)
    air: Air = Air()
    furniture: tuple[Box, ...] = ()
    mesh: str | None = None
    notes: str = ""
    sources: str = ""

    @field_validator("surfaces", mode="after")
    @classmethod
    def _known_walls(cls, surfaces: dict[str, Surface]) -> dict[str, Surface]:
        unknown = set(surfaces) - {*WALLS, "all", "walls"}
        if unknown:
            raise ValueError(
                f"unknown surfaces {sorted(unknown)};"
                f" known: {', '.join(WALLS)}, walls (the four sides), all"
            )
        return surfaces

    @model_validator(mode="after")
    def _covered(self) -> Self:
        missing = [wall for wall in WALLS if self._find(wall) is None]
        if missing and self.mesh is None:
            raise ValueError(f"no surface is stated for {', '.join(missing)}")
        for box in self.furniture:
            if (
                np.any(np.array(box.high) > np.array(self.size_m) + 1e-9)
                or min(box.low) < 0
            ):
                raise ValueError(f"furniture {box.name!r} sticks out of the room")
        return self

    def _find(self, wall: str) -> Surface | None:
        side = "walls" if wall[0] in "xy" else "all"
        for key in (wall, side, "all"):
            if key in self.surfaces:
                return self.surfaces[key]
        return None

    @staticmethod
    def load(path: str | Path) -> "RoomSpec":
        """Read a room from a YAML file.

        Raises
        ------
        ConfigError
            With every mistake and its place.
        """
        return load_yaml(path, RoomSpec)

    def surface(self, wall: str) -> Surface:
        """Return the surface of one of `WALLS`."""
        found = self._find(wall)
        if found is None:
            raise KeyError(wall)
        return found

    @property
    def bands(self) -> FloatArray:
        """Octave-band centres of all per-band values [Hz], shape (7,)."""
        return _BANDS.copy()

    @property
    def absorption(self) -> FloatArray:
        """Absorption per wall (order of `WALLS`) and octave, shape (6, 7)."""
        return np.array([self.surface(wall).absorption_per_band for wall in WALLS])

    @property
    def scattering(self) -> FloatArray:
        """Scattering per wall (order of `WALLS`) and octave, shape (6, 7)."""
        return np.array([self.surface(wall).scattering_per_band for wall in WALLS])

    @property
    def volume_m3(self) -> float:
        """Volume of the box [m³]."""
        return float(np.prod(self.size_m))

    @property
    def wall_areas_m2(self) -> FloatArray:
        """Area of each of `WALLS` [m²], shape (6,)."""
        x, y, z = self.size_m
        return np.array([y * z, y * z, x * z, x * z, x * y, x * y])

    @property
    def surface_area_m2(self) -> float:
        """Total wall area [m²]."""
        return float(self.wall_areas_m2.sum())

    def eyring_t60(self, *, air: bool = True) -> FloatArray:
        """Return the reverberation time Eyring predicts per octave [s], shape (7,).

        References
        ----------
        C. F. Eyring, JASA 1, 217 (1930): T = 24 ln(10) V / (c (4 m V - S ln(1 - a)))
        with the area-weighted mean absorption a and the air's energy attenuation
        m [1/m].
        """
        mean = self.wall_areas_m2 @ self.absorption / self.surface_area_m2
        with np.errstate(divide="ignore"):
            exponent = -self.surface_area_m2 * np.log1p(-np.minimum(mean, 1.0))
        loss = self.air.absorption(_BANDS) / (10 * np.log10(np.e)) if air else 0.0
        decay = self.air.speed_of_sound * (exponent + 4 * loss * self.volume_m3)
        with np.errstate(divide="ignore"):
            return 24 * np.log(10) * self.volume_m3 / decay

    def check_inside(self, position: ArrayLike, clearance: float = 0.0) -> None:
        """Raise `OutOfReachError` unless a position is free air.

        Parameters
        ----------
        position : array_like, shape (3,)
            Position [m].
        clearance : float
            Distance kept to walls and furniture [m].
        """
        p = np.asarray(position, dtype=float)
        shown = f"({p[0]:.2f}, {p[1]:.2f}, {p[2]:.2f}) m"
        if np.any(p < clearance) or np.any(p > np.array(self.size_m) - clearance):
            size = " × ".join(f"{length:g}" for length in self.size_m)
            raise OutOfReachError(
                f"{shown} is not {clearance:g} m inside {self.name} ({size} m)"
            )
        for box in self.furniture:
            distance = box.distance(p)
            if distance < clearance or distance == 0:
                raise OutOfReachError(
                    f"{shown} is {distance:.2f} m from {box.name}; keep {clearance:g} m"
                )
