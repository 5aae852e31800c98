"""What is simulated: a shape, its materials, the air, and both gain patterns."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir import GainPattern, RoomSpec
from rir.errors import SceneError
from rir.physics import octave_centers
from rir.room import WALLS, Air
from rooms.geometry import Geometry, Shoebox
from rooms.hardware import Hardware

__all__ = ["Scene"]

FloatArray = NDArray[np.float64]
_BANDS = octave_centers(125.0, 8000.0)


def spread_shares(what: str, values: Any, surfaces: int) -> FloatArray:
    """Return shares per surface and octave from any of the forms users write.

    Parameters
    ----------
    what : str
        Name used in messages.
    values : float, array_like or mapping
        One number; one per octave (7); one row per surface, of 1 or 7 columns;
        or a mapping from wall name (or "walls", "all") to such numbers.
    surfaces : int
        Number of surfaces.

    Raises
    ------
    SceneError
        If the shape fits nothing, or a share lies outside 0…1.

    Examples
    --------
    >>> spread_shares("absorption", {"all": 0.1, "floor": 0.5}, 6)[:, 0].tolist()
    [0.1, 0.1, 0.1, 0.1, 0.5, 0.1]
    """
    if isinstance(values, Mapping):
        values = [_named(what, values, wall) for wall in WALLS]
    array = np.asarray(values, dtype=float)
    try:
        spread = np.broadcast_to(array, (surfaces, len(_BANDS))).copy()
    except ValueError as error:
        raise SceneError(
            f"{what} of shape {array.shape} fits neither 1 nor {len(_BANDS)} octaves"
            f" of {surfaces} surfaces"
        ) from error
    if not np.all((spread >= 0) & (spread <= 1)):
        raise SceneError(f"{what} must lie in 0…1; got {np.abs(spread).max():g}")
    return spread


def _named(what: str, values: Mapping[str, Any], wall: str) -> FloatArray:
    for key in (wall, "walls" if wall[0] in "xy" else "all", "all"):
        if key in values:
            return np.broadcast_to(np.asarray(values[key], float), len(_BANDS))
    raise SceneError(f"no {what} is stated for {wall}; known: {', '.join(values)}")


@dataclass(frozen=True, eq=False)
class Scene:
    """A room to simulate, with the patterns of the two devices in it.

    Parameters
    ----------
    geometry : Shoebox or MeshGeometry
        Shape of the room.
    absorption, scattering, transmission : ndarray, shape (surfaces, bands)
        Shares of the energy arriving at each surface, per octave.
    air : Air
        Temperature, humidity, pressure.
    emitter_gain, listener_gain : GainPattern
        Amplitude gains in the device frames.
    name : str
        Shown in reports.
    hardware : Hardware, optional
        A measuring chain that responses pass through at the end.
    emitter_speed : float
        How fast the emitter moves [m/s]; judged by the planner.

    Examples
    --------
    >>> scene = Scene.shoebox((6, 5, 3), absorption=0.2)
    >>> scene.eyring_t60(air=False).round(3)[0]
    np.float64(0.515)
    """

    geometry: Geometry
    absorption: FloatArray
    scattering: FloatArray
    transmission: FloatArray
    bands: FloatArray = field(default_factory=lambda: _BANDS.copy())
    air: Air = field(default_factory=Air)
    emitter_gain: GainPattern = field(default_factory=GainPattern.omni)
    listener_gain: GainPattern = field(default_factory=GainPattern.omni)
    name: str = "scene"
    hardware: Hardware | None = None
    emitter_speed: float = 0.0

    def __post_init__(self) -> None:
        if np.any(self.transmission > self.absorption + 1e-12):
            raise SceneError(
                "transmission cannot exceed absorption: what passes through a"
                " surface is part of what it does not reflect"
            )

    @staticmethod
    def shoebox(
        size: ArrayLike,
        *,
        absorption: Any = 0.2,
        scattering: Any = 0.0,
        air: Air | None = None,
        emitter_gain: GainPattern | None = None,
        listener_gain: GainPattern | None = None,
        name: str = "shoebox",
        **changes: Any,
    ) -> "Scene":
        """Return a box-shaped scene.

        Parameters
        ----------
        size : array_like, shape (3,)
            Lengths along x, y, z [m]; a corner lies at the origin.
        absorption, scattering : float, array_like or mapping
            See `spread_shares`: per room, octave, wall, or wall and octave.
        air : Air, optional
            20 °C, 50 %, 101.325 kPa when left out.
        emitter_gain, listener_gain : GainPattern, optional
            Omnidirectional when left out.
        name : str
            Shown in reports.
        **changes
            Any further field of `Scene`.
        """
        return Scene(
            Shoebox(np.asarray(size, dtype=float)),
            spread_shares("absorption", absorption, 6),
            spread_shares("scattering", scattering, 6),
            np.zeros((6, len(_BANDS))),
            air=air or Air(),
            emitter_gain=emitter_gain or GainPattern.omni(),
            listener_gain=listener_gain or GainPattern.omni(),
            name=name,
            **changes,
        )

    @staticmethod
    def from_room(room: RoomSpec, **changes: Any) -> "Scene":
        """Return the scene of a room specification.

        Parameters
        ----------
        room : RoomSpec
            Size, surfaces and air.
        **changes
            Any field of `Scene`, replacing what the room says.
        """
        scene = Scene.shoebox(
            room.size_m,
            absorption=room.absorption,
            scattering=room.scattering,
            air=room.air,
            name=room.name,
        )
        return replace(scene, **changes)

    @staticmethod
    def from_mesh(path: Any, materials: Any = None, **changes: Any) -> "Scene":
        """Return the scene of a mesh file (OBJ, PLY, GLB, STL).

        Parameters
        ----------
        path : str or Path
            The mesh; it need not be watertight, see `remarks`.
        materials : str, float or mapping, optional
            See `rooms.surfaces.resolve_surfaces`; without it the names of the
            mesh's own materials are looked up in the bundled table.
        **changes
            Any field of `Scene`.
        """
        from rooms.mesh import MeshGeometry

        geometry = MeshGeometry.from_file(path)
        named = {"name": Path(path).stem, **changes}
        return Scene.of_geometry(geometry, materials, **named)

    @staticmethod
    def extruded(
        outline: ArrayLike, height: float, materials: Any = 0.2, **changes: Any
    ) -> "Scene":
        """Return a room with vertical walls on a floor plan.

        Parameters
        ----------
        outline : array_like, shape (n, 2)
            Corners of the floor [m], in order.
        height : float
            Height of the ceiling [m].
        materials : str, float or mapping
            See `rooms.surfaces.resolve_surfaces`; the surfaces are called
            ``floor``, ``ceiling``, ``wall0``, ``wall1``, ….
        **changes
            Any field of `Scene`.
        """
        from rooms.mesh import MeshGeometry

        geometry = MeshGeometry.extruded(outline, height)
        return Scene.of_geometry(geometry, materials, **changes)

    @staticmethod
    def of_geometry(geometry: Any, materials: Any, **changes: Any) -> "Scene":
        """Return the scene of a mesh geometry with named surfaces."""
        from rooms.surfaces import resolve_surfaces

        shares = resolve_surfaces(geometry.surface_names, materials)
        return replace(Scene(geometry, *shares), **changes)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What was repaired in the geometry, or left open."""
        return tuple(getattr(self.geometry, "report", ()))

    @property
    def mean_absorption(self) -> FloatArray:
        """Area-weighted mean absorption per octave, shape (bands,)."""
        areas = self.geometry.areas
        return areas @ self.absorption / areas.sum()

    @property
    def speed_of_sound(self) -> float:
        """Speed of sound [m/s]."""
        return self.air.speed_of_sound

    @property
    def air_loss(self) -> FloatArray:
        """Energy attenuation of the air per octave [1/m], shape (bands,)."""
        return self.air.absorption(self.bands) / (10 * np.log10(np.e))

    def eyring_t60(self, *, air: bool = True) -> FloatArray:
        """Return Eyring's reverberation time per octave [s], shape (bands,)."""
        area, volume = self.geometry.areas.sum(), self.geometry.volume
        with np.errstate(divide="ignore"):
            exponent = -area * np.log1p(-self.mean_absorption)
            loss = 4 * volume * self.air_loss if air else 0.0
            return 24 * np.log(10) * volume / (self.speed_of_sound * (exponent + loss))

    def check_inside(self, what: str, points: ArrayLike) -> None:
        """Raise `SceneError` unless every point, shape (N, 3), lies in the room."""
        points = np.asarray(points, dtype=float).reshape(-1, 3)
        outside = self.geometry.outside(points)
        if outside.any():
            first = points[np.argmax(outside)]
            raise SceneError(
                f"{what} ({first[0]:.3f}, {first[1]:.3f}, {first[2]:.3f}) m lies"
                f" outside {self.name}; {int(outside.sum())} of {len(points)} do"
            )
