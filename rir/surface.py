"""What one surface of a room does to sound, as files state it."""

from functools import cached_property
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from rir.arrays import FloatArray
from rir.bands import octave_centers
from rir.config import StrictModel
from rir.errors import ResoundingError
from rir.materials import load_materials
from rir.seats import SeatRows
from rir.walls import (
    Admittance,
    Impedance,
    LayeredWall,
    OneLayer,
    WallModel,
    random_incidence_octaves,
    read_wall,
    real_admittance,
)

__all__ = ["Share", "Surface", "per_octave", "with_shares"]

Share = Annotated[float, Field(ge=0.0, le=1.0)]

_BANDS = octave_centers(125.0, 8000.0)
_SHARES = ("absorption", "scattering", "transmission")
_KINDS = ("material", "absorption", "admittance", "impedance", "layers", "wall")


def per_octave(values: Any) -> Any:
    """Return shares as seven, 125 Hz to 8 kHz; what is no share is returned as it is.

    Parameters
    ----------
    values : number, sequence or mapping
        One number for all octaves; seven; six from 125 Hz to 4 kHz, whose last holds
        at 8 kHz as well; or a mapping from frequency [Hz] to share, interpolated over
        the logarithm of frequency and held beyond its ends.

    Examples
    --------
    >>> per_octave({250: 0.1, 1000: 0.3})
    [0.1, 0.1, 0.2, 0.3, 0.3, 0.3, 0.3]
    """
    if isinstance(values, int | float):
        # A wrong number stays single, so that it is told once and not per octave.
        return [values] * (len(_BANDS) if 0 <= values <= 1 else 1)
    if isinstance(values, dict):
        try:
            rows = sorted((float(f), float(share)) for f, share in values.items())
            f, share = np.array(rows, dtype=float).T
            over = np.interp(np.log(_BANDS), np.log(f), share).round(12)
        except (TypeError, ValueError):
            return values
        return over.tolist() if np.all(f > 0) else values
    if isinstance(values, list | tuple) and len(values) == len(_BANDS) - 1:
        return [*values, values[-1]]
    return values


def with_shares(data: Any) -> Any:
    """Return what a file says with its shares per octave."""
    if not isinstance(data, dict):
        return data
    return {
        key: per_octave(value) if key in _SHARES else value
        for key, value in data.items()
    }


class Surface(StrictModel):
    """What one surface does to sound: absorption and scattering per octave.

    Give a `material` of the bundled table, or `absorption`: shares that are the same at
    every angle of incidence. Or state what depends on the angle: an `admittance` or
    `impedance`, `layers` from the room to their `backing`, or a `wall` of a kind that
    another package adds, as ``{kind: settings}``; its absorption is then that of
    diffuse sound. With `locally_reacting` a stated absorption is that of a wall with a
    real admittance, and layers are crossed straight at every angle. Any may be combined
    with `scattering`, and in meshes with `transmission`. Shares come in any form of
    `per_octave`. `seats` says that the surface stands for rows of seats: true for
    typical ones, or what differs of `SeatRows`; false where a material of the table
    says so and it is none.

    Examples
    --------
    >>> wool = {"thickness_m": 0.05, "flow_resistivity_pa_s_m2": 10000}
    >>> surface = Surface(layers=[{"porous": wool}, {"air_gap": {"thickness_m": 0.1}}])
    >>> surface.absorption_per_band.round(2).tolist()
    [0.29, 0.61, 0.85, 0.86, 0.92, 0.95, 0.96]
    """

    material: str | None = None
    absorption: tuple[Share, ...] | None = None
    scattering: tuple[Share, ...] | None = None
    transmission: tuple[Share, ...] | None = None
    admittance: Admittance | None = None
    impedance: Impedance | None = None
    layers: tuple[OneLayer, ...] | None = None
    backing: Literal["rigid", "air"] | None = None
    wall: dict[str, Any] | None = None
    locally_reacting: bool = False
    seats: SeatRows | Literal[False] | None = None

    @model_validator(mode="before")
    @classmethod
    def _expand(cls, data: Any) -> Any:
        if isinstance(data, dict) and data.get("seats") is True:
            data = {**data, "seats": {}}
        return with_shares({"material": data} if isinstance(data, str) else data)

    @model_validator(mode="after")
    def _complete(self) -> Self:
        given = [kind for kind in _KINDS if getattr(self, kind) is not None]
        if len(given) != 1:
            raise ValueError(
                f"give one of {', '.join(_KINDS[:-1])} or {_KINDS[-1]};"
                f" got {' and '.join(given) or 'none'}"
            )
        if self.backing is not None and self.layers is None:
            raise ValueError("a backing needs layers in front of it")
        if self.material is not None and self.material not in load_materials():
            try:
                load_materials()[self.material]
            except KeyError as error:
                raise ValueError(str(error)) from error
        for name in _SHARES:
            values = getattr(self, name)
            if values is not None and len(values) != len(_BANDS):
                raise ValueError(
                    f"{name} needs 1, 6 or {len(_BANDS)} values (octaves 125 Hz to 4 or"
                    f" 8 kHz) or a mapping from Hz to value, not {len(values)}"
                )
        try:
            self.wall_model  # noqa: B018 - what cannot be built is a mistake
        except ResoundingError as error:
            raise ValueError(str(error)) from error
        return self

    @cached_property
    def wall_model(self) -> WallModel | None:
        """What the surface answers at each angle; None where all angles are alike."""
        if self.layers is not None:
            return LayeredWall(
                layers=self.layers,
                locally_reacting=self.locally_reacting,
                backing=self.backing or "rigid",
            )
        if self.wall is not None:
            if len(self.wall) != 1:
                raise ValueError("a wall is one kind and its settings: {kind: {…}}")
            ((name, settings),) = self.wall.items()
            return read_wall(name, settings)
        if self.locally_reacting and self.admittance is None and self.impedance is None:
            conductance = real_admittance(self._values("absorption", 0.0))
            return Admittance(conductance=tuple(conductance.tolist()))
        return self.admittance or self.impedance

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
        if self.material is None and self.absorption is None and self.wall_model:
            return random_incidence_octaves(self.wall_model, _BANDS)
        return self._values("absorption", 0.0)

    @property
    def scattering_per_band(self) -> FloatArray:
        """Scattering per octave, shape (7,); 0 when nothing is stated."""
        return self._values("scattering", 0.0)

    @property
    def transmission_per_band(self) -> FloatArray:
        """Share that passes through, per octave, shape (7,); 0 when not stated."""
        return self._values("transmission", 0.0)

    @property
    def seat_rows(self) -> SeatRows | None:
        """The seats that the surface stands for; None if it stands for none."""
        if self.seats is None and self.material is not None:
            marked = load_materials()[self.material].get("seats")
            return None if marked is None else SeatRows(**marked)
        return self.seats or None

    @property
    def scattering_known(self) -> bool:
        """Whether scattering is stated, here or in the table of materials."""
        table = {} if self.material is None else load_materials()[self.material]
        return self.scattering is not None or "scattering" in table
