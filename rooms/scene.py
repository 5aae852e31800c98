"""What is simulated: a shape, its materials, the air, and both gain patterns."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir import GainPattern, RoomSpec
from rir.arrays import FloatArray
from rir.bands import octave_centers
from rir.errors import SceneError
from rir.numbers import read_array, read_number, shown
from rir.room import WALLS, Air, SeatRows
from rir.walls import WallModel, random_incidence_octaves
from rooms.furniture import Furniture, furnished_mesh
from rooms.geometry import Geometry, Shoebox
from rooms.hardware import Hardware
from rooms.surfaces import (
    check_walls,
    notes_on_seats,
    resolve_seats,
    resolve_surfaces,
    spread_shares,
    wall_models,
)

__all__ = ["Scene"]

_BANDS = octave_centers(125.0, 8000.0)


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
    notes : tuple of str
        What else people should know of the room, see `remarks`.
    walls : mapping
        Row of a surface to the `rir.walls.WallModel` that it answers by at each angle;
        surfaces that are not in it reflect alike at all angles. Their absorption
        is that of diffuse sound.
    furniture : Furniture, optional
        Boxes that stand in a box-shaped room; see `furnished`.
    seats : tuple of SeatRows or None
        Rows of seats that each surface stands for; empty where none does.

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
    notes: tuple[str, ...] = ()
    walls: Mapping[int, WallModel] = field(default_factory=dict)
    furniture: Furniture | None = None
    seats: tuple[SeatRows | None, ...] = ()

    def __post_init__(self) -> None:
        read_number(
            self.emitter_speed, "emitter_speed [m/s]", least=0, error=SceneError
        )
        object.__setattr__(self, "name", str(self.name))
        for field_name, kind in _KINDS.items():
            value = getattr(self, field_name)
            if not isinstance(value, kind):
                wanted = " or ".join(k.__name__ for k in np.atleast_1d(kind))
                raise SceneError(
                    f"{field_name} must be of {wanted}, not {shown(value)}"
                )
        bands = read_array(self.bands, "bands [Hz]", "leave them out", SceneError)
        ascending = bands.ndim == 1 and np.all(np.diff(bands, prepend=0.0) > 0)
        if not ascending or self.absorption.shape[1:] != bands.shape:
            raise SceneError(
                f"bands are ascending frequencies, one per column of absorption"
                f" {self.absorption.shape}, not {shown(self.bands)}"
            )
        rows = range(len(self.absorption))
        check_walls(self.walls, len(rows))
        if len(self.seats) not in (0, len(rows)):
            raise SceneError(f"seats need SeatRows or None for {len(rows)} surfaces")
        if np.any(self.transmission > self.absorption + 1e-12):
            raise SceneError(
                "transmission cannot exceed absorption: what passes through a"
                " surface is part of what it does not reflect"
            )
        if self.furniture is not None and not self.geometry.lattice:
            raise SceneError(
                "furniture stands in boxes; a mesh has it among its surfaces"
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
        walls: Mapping[str, WallModel] | None = None,
        **changes: Any,
    ) -> "Scene":
        """Return a box-shaped scene.

        Parameters
        ----------
        size : array_like, shape (3,)
            Lengths along x, y, z [m]; a corner lies at the origin.
        absorption, scattering : float, array_like or mapping
            Per room, octave, wall, or wall and octave; see
            `rooms.surfaces.spread_shares`.
        air : Air, optional
            20 °C, 50 %, 101.325 kPa when left out.
        emitter_gain, listener_gain : GainPattern, optional
            Omnidirectional when left out.
        name : str
            Shown in reports.
        walls : mapping, optional
            Name of a wall (or "walls", "all") to a `rir.walls.WallModel`, whose
            absorption of diffuse sound then stands for what is stated for the wall.
        **changes
            `hardware`, `emitter_speed`, `notes`, `furniture` or `seats`, see `Scene`.

        Raises
        ------
        SceneError
            If a length is not positive, or a share or a field is not what it must be.
        """
        known = ("hardware", "emitter_speed", "notes", "furniture", "seats")
        unknown = ", ".join(sorted(set(changes) - set(known)))
        if unknown:
            raise SceneError(
                f"a box takes no {unknown}; besides the named ones: {', '.join(known)}"
            )
        models = wall_models({} if walls is None else walls)
        shares = spread_shares("absorption", absorption, 6)
        for row, model in models.items():
            shares[row] = random_incidence_octaves(model, _BANDS)
        return Scene(
            Shoebox(read_array(size, "lengths of a box [m]", "", SceneError)),
            shares,
            spread_shares("scattering", scattering, 6),
            np.zeros((6, len(_BANDS))),
            air=Air() if air is None else air,
            emitter_gain=GainPattern.omni() if emitter_gain is None else emitter_gain,
            listener_gain=(
                GainPattern.omni() if listener_gain is None else listener_gain
            ),
            name=name,
            walls=models,
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
        if not isinstance(room, RoomSpec):
            raise SceneError(
                f"a room is a RoomSpec, not {shown(room)}; read one by RoomSpec.load"
            )
        if room.mesh is not None:
            raise SceneError(
                f"{room.name} is a mesh, {room.mesh}; open its room file by"
                " rooms.builtin.load_scene"
            )
        scene = Scene.shoebox(
            room.size_m,
            absorption=room.absorption,
            scattering=room.scattering,
            air=room.air,
            name=room.name,
            furniture=Furniture.of(room),
            seats=tuple(room.surface(wall).seat_rows for wall in WALLS),
        )
        models = {row: room.surface(wall).wall_model for row, wall in enumerate(WALLS)}
        known = {row: model for row, model in models.items() if model is not None}
        return replace(scene, **{"walls": known, **changes})

    @staticmethod
    def from_mesh(
        path: Any,
        materials: Any = None,
        *,
        up: str = "z",
        scale: float = 1.0,
        **changes: Any,
    ) -> "Scene":
        """Return the scene of a mesh file (OBJ, PLY, GLB, STL).

        Parameters
        ----------
        path : str or Path
            The mesh; it need not be watertight, see `remarks`.
        materials : str, float or mapping, optional
            See `rooms.surfaces.resolve_surfaces`; without it the names of the
            mesh's own materials are looked up in the bundled table.
        up, scale : str, float
            Which axis of the file points up, and the length of its unit [m].
        **changes
            Any field of `Scene`.
        """
        from rooms.mesh import MeshGeometry

        if not isinstance(path, str | Path):
            raise SceneError(
                f"a mesh is given by its path, not by {shown(path)}; for arrays see"
                " rooms.mesh.MeshGeometry.from_arrays"
            )
        geometry = MeshGeometry.from_file(path, up=up, scale=scale)
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

        corners = read_array(
            outline, "corners of a floor [m]", "give rows of x and y", SceneError
        )
        tall = read_number(
            height, "the height of a room [m]", above=0, error=SceneError
        )
        geometry = MeshGeometry.extruded(corners, tall)
        return Scene.of_geometry(geometry, materials, **changes)

    @staticmethod
    def of_geometry(geometry: Geometry, materials: Any, **changes: Any) -> "Scene":
        """Return the scene of a mesh geometry with named surfaces."""
        stated = geometry.surface_names, materials
        shares, seats = resolve_surfaces(*stated), resolve_seats(*stated)
        changes["notes"] = (*notes_on_seats(*stated), *changes.get("notes", ()))
        try:
            scene = Scene(geometry, *shares[:3], walls=shares[3], seats=seats)
            return replace(scene, **changes)
        except TypeError as error:
            raise SceneError(
                f"no such field of a scene: {', '.join(changes)}; see rooms.Scene"
            ) from error

    @property
    def remarks(self) -> tuple[str, ...]:
        """Repairs of the geometry, what it leaves open or mirrors only, and `notes`."""
        told = self.geometry.report + self.geometry.estimates
        names = self.geometry.surface_names
        rough = np.max(self.scattering, axis=1, initial=0.0) > 0
        each = zip(names, rough.tolist(), strict=False)
        plain = [name for name, some in each if not some]
        if plain:
            shown_ = ", ".join(plain[:6]) + (", …" if len(plain) > 6 else "")
            told += (
                f"no scattering is stated for {shown_}: they mirror only, and such"
                " rooms decay more slowly than real ones",
            )
        if self.emitter_speed > 0:
            told += (
                f"the emitter moves at {self.emitter_speed:g} m/s: a response is that"
                " of the instant of emission; rooms.motion renders a list of poses",
            )
        return told + self.notes

    @property
    def mean_absorption(self) -> FloatArray:
        """Mean absorption of surfaces and openings per octave, shape (bands,)."""
        areas, lost = self.geometry.areas, self.geometry.open_share
        return lost + (1 - lost) * (areas @ self.absorption) / areas.sum()

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
        # an opening bounds the room as a wall does
        area = area / max(1 - self.geometry.open_share, 1e-3)
        with np.errstate(divide="ignore"):
            exponent = -area * np.log1p(-self.mean_absorption)
            loss = 4 * volume * self.air_loss if air else 0.0
            return 24 * np.log(10) * volume / (self.speed_of_sound * (exponent + loss))

    @property
    def furnished(self) -> "Scene":
        """The same room as a mesh with its furniture; itself where there is none."""
        return self if self.furniture is None else _furnished(self)

    def outside(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Tell which points, shape (N, 3), lie outside the room or in furniture."""
        outside = self.geometry.outside(points)
        if self.furniture is not None:
            outside = outside | self.furniture.holds(points)
        return outside

    def check_inside(self, what: str, points: ArrayLike) -> None:
        """Raise `SceneError` unless every point, shape (N, 3), lies in the room."""
        points = np.asarray(points, dtype=float).reshape(-1, 3)
        outside = self.outside(points)
        if outside.any():
            first = points[np.argmax(outside)]
            raise SceneError(
                f"{what} ({first[0]:.3f}, {first[1]:.3f}, {first[2]:.3f}) m lies"
                f" outside {self.name}; {int(outside.sum())} of {len(points)} do"
            )


@lru_cache(maxsize=8)
def _furnished(scene: Scene) -> Scene:
    pieces = scene.furniture
    if pieces is None:
        return scene
    geometry = furnished_mesh(pieces, tuple(map(float, scene.geometry.size)))
    rows = [[*WALLS, *pieces.names].index(name) for name in geometry.surface_names]
    # sound that passes a piece crosses two of its faces
    shares = [
        np.concatenate([walls, faces])[rows]
        for walls, faces in (
            (scene.absorption, pieces.absorption),
            (scene.scattering, pieces.scattering),
            (scene.transmission, np.sqrt(pieces.transmission)),
        )
    ]
    named = dict(zip(("absorption", "scattering", "transmission"), shares, strict=True))
    walls = {
        rows.index(row): model for row, model in scene.walls.items() if row in rows
    }
    standing = [seat and seat.on_floor for seat in scene.seats]
    seats = tuple(standing[row] if row < len(standing) else None for row in rows)
    changes = {"furniture": None, "walls": walls, "seats": seats}
    return replace(scene, geometry=geometry, **changes, **named)


_KINDS: dict[str, Any] = {
    "air": Air,
    "emitter_gain": GainPattern,
    "listener_gain": GainPattern,
    "hardware": (Hardware, type(None)),
    "furniture": (Furniture, type(None)),
}
