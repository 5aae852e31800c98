"""A room as data: size, surfaces, air, furniture."""

from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import (
    AfterValidator,
    Field,
    FiniteFloat,
    field_validator,
    model_validator,
)

from rir.air import Air
from rir.arrays import FloatArray
from rir.bands import octave_centers
from rir.config import StrictModel, load_yaml
from rir.errors import OutOfReachError
from rir.pose import Pose
from rir.seats import SeatRows
from rir.surface import Share, Surface, per_octave, with_shares

__all__ = [
    "WALLS",
    "Air",
    "Box",
    "Place",
    "RoomSpec",
    "SeatRows",
    "Surface",
    "per_octave",
]

WALLS = ("x0", "x1", "y0", "y1", "floor", "ceiling")
"""Surfaces of a shoebox in the order of every per-wall array."""

_BANDS = octave_centers(125.0, 8000.0)
_Length = Annotated[float, AfterValidator(lambda value: _checked_length(value))]
_Point = tuple[FiniteFloat, FiniteFloat, FiniteFloat]
_SHARES = ("absorption", "scattering", "transmission")


def _checked_length(value: float) -> float:
    """Return a length [m]; NaN says that none is stated, as a mesh needs none."""
    if not (np.isnan(value) or 0 < value <= 1000):
        raise ValueError(f"a length lies above 0 and up to 1000 m, not {value:g}")
    return value


class Place(StrictModel):
    """Where a device stands and looks, in a room file.

    In YAML a list of three coordinates is a place as well.
    """

    at: _Point
    yaw_deg: float = 0.0
    pitch_deg: float = 0.0
    name: str = ""

    @model_validator(mode="before")
    @classmethod
    def _expand(cls, data: Any) -> Any:
        return {"at": data} if isinstance(data, list | tuple) else data

    @property
    def pose(self) -> Pose:
        """Position and orientation in the room frame."""
        return Pose.at(*self.at, yaw_deg=self.yaw_deg, pitch_deg=self.pitch_deg)


FURNITURE_MATERIAL = "wooden_furniture"
"""Of the bundled table: what a piece is made of that states nothing."""


class Box(StrictModel):
    """An axis-aligned box that stands in a room; see `RoomSpec` for what it does.

    Its faces are stated as those of a `Surface`; wooden furniture where nothing is.
    `transmission` is the share of energy that passes the whole piece.
    """

    name: str = "box"
    low: _Point
    high: _Point
    material: str | None = None
    absorption: tuple[Share, ...] | None = None
    scattering: tuple[Share, ...] | None = None
    transmission: tuple[Share, ...] | None = None

    @model_validator(mode="before")
    @classmethod
    def _expand(cls, data: Any) -> Any:
        return with_shares(data)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not all(a < b for a, b in zip(self.low, self.high, strict=True)):
            raise ValueError(f"low {self.low} must lie below high {self.high}")
        _ = self.surface
        return self

    @property
    def assumed(self) -> bool:
        """Whether nothing is stated of its faces."""
        return self.material is None and self.absorption is None

    @property
    def surface(self) -> Surface:
        """What its faces do to sound."""
        stated = {name: getattr(self, name) for name in ("material", *_SHARES)}
        if self.assumed:
            stated["material"] = FURNITURE_MATERIAL
        return Surface.model_validate(stated)

    def distance(self, point: ArrayLike) -> float:
        """Return the distance of a point to the box [m]; 0 inside."""
        p = np.asarray(point, dtype=float)
        low, high = np.array(self.low), np.array(self.high)
        return float(np.linalg.norm(np.maximum(0, np.maximum(low - p, p - high))))


class RoomSpec(StrictModel):
    """A room: a box of `size_m`, or a mesh, with surfaces, air and furniture.

    The origin of a box is a corner on the floor; x, y, z run along `size_m`. A mesh
    keeps its own coordinates, needs no size, and its surfaces are called as its
    materials; `mesh_scale` is the length of its unit [m], and with `mesh_up` y its
    (x, y, z) are the room's (x, z, -y). `emitters` and `listeners` are places to
    simulate or measure between; `default_scattering` is that of surfaces that state
    none.

    `furniture` are boxes, each with a surface of its own: devices keep out of them,
    fields that look at the room see them as surfaces, and in a box sound is reflected,
    shaded, bent and let through by them.

    Examples
    --------
    >>> walls = {"all": {"absorption": 0.2}}
    >>> room = RoomSpec(name="box", size_m=(6, 5, 3), surfaces=walls)
    >>> float(room.eyring_t60(air=False)[0].round(3))
    0.515
    """

    name: str
    size_m: tuple[_Length, _Length, _Length] = (np.nan, np.nan, np.nan)
    surfaces: dict[str, Surface] = Field(default_factory=dict)
    air: Air = Air()
    default_scattering: tuple[Share, ...] = (0.0,) * len(_BANDS)
    furniture: tuple[Box, ...] = ()
    emitters: tuple[Place, ...] = ()
    listeners: tuple[Place, ...] = ()
    mesh: str | None = None
    mesh_up: Literal["y", "z"] = "z"
    mesh_scale: Annotated[float, Field(gt=0.0)] = 1.0
    notes: str = ""
    sources: str = ""

    @field_validator("default_scattering", mode="before")
    @classmethod
    def _expand(cls, value: Any) -> Any:
        return per_octave(value)

    @model_validator(mode="after")
    def _covered(self) -> Self:
        if self.mesh is None:
            self._check_box()
        for box in self.furniture:
            if (
                np.any(np.array(box.high) > np.array(self.size_m) + 1e-9)
                or min(box.low) < 0
            ):
                raise ValueError(f"furniture {box.name!r} sticks out of the room")
        return self

    def _check_box(self) -> None:
        unknown = set(self.surfaces) - {*WALLS, "all", "walls"}
        if unknown:
            raise ValueError(
                f"unknown surfaces {sorted(unknown)};"
                f" known: {', '.join(WALLS)}, walls (the four sides), all"
            )
        if np.isnan(self.size_m).any():
            raise ValueError("state size_m, three lengths in m, or a mesh")
        missing = [wall for wall in WALLS if self._find(wall) is None]
        if missing:
            raise ValueError(f"no surface is stated for {', '.join(missing)}")

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
        return np.array([self.scattering_of(self.surface(wall)) for wall in WALLS])

    def scattering_of(self, surface: Surface) -> FloatArray:
        """Return the scattering of a surface per octave, shape (7,)."""
        if surface.scattering_known:
            return surface.scattering_per_band
        return np.array(self.default_scattering)

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
