"""Give the surfaces of a room their materials."""

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from rir.arrays import FloatArray
from rir.bands import octave_centers
from rir.config import validate
from rir.errors import SceneError
from rir.materials import load_materials
from rir.numbers import read_array, shown
from rir.room import WALLS, Surface
from rir.seats import SeatRows, names_seats
from rir.walls import WallModel

__all__ = [
    "Shares",
    "check_walls",
    "notes_on_seats",
    "resolve_seats",
    "resolve_surfaces",
    "spread_shares",
    "wall_models",
]

Shares = tuple[FloatArray, FloatArray, FloatArray, dict[int, WallModel]]
_ANY = ("all", "default")
_BANDS = octave_centers(125.0, 8000.0)
_SHARES = "give one number of 0…1, one per octave (7), or a mapping from wall to such"


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
    array = read_array(values, what, _SHARES, SceneError)
    try:
        spread = np.broadcast_to(array, (surfaces, len(_BANDS))).copy()
    except ValueError as error:
        raise SceneError(
            f"{what} of shape {array.shape} fits neither 1 nor {len(_BANDS)} octaves"
            f" of {surfaces} surfaces"
        ) from error
    wrong = ~((spread >= 0) & (spread <= 1))
    if wrong.any():
        raise SceneError(
            f"{what} must lie in 0…1; got {spread[wrong][0]:g}"
            f" ({wrong.sum()} of {wrong.size} are outside)"
        )
    return spread


def _named(what: str, values: Mapping[str, Any], wall: str) -> FloatArray:
    for key in (wall, "walls" if wall[0] in "xy" else "all", "all"):
        if key in values:
            array = read_array(values[key], f"{what} of {key!r}", _SHARES, SceneError)
            if array.size not in (1, len(_BANDS)):
                raise SceneError(
                    f"{what} of {key!r} has {array.size} numbers, not 1 or"
                    f" {len(_BANDS)}; {_SHARES}"
                )
            return np.broadcast_to(array.ravel(), len(_BANDS))
    known = ", ".join(map(str, values)) or "none"
    raise SceneError(
        f"no {what} is stated for {wall}; stated: {known}; add {wall!r} or 'all'"
    )


def wall_models(walls: Mapping[str, WallModel]) -> dict[int, WallModel]:
    """Return the models of a box's walls by row; the nearest name holds."""
    known = {*WALLS, "walls", "all"}
    for name, model in walls.items():
        if name not in known:
            raise SceneError(f"no wall {name!r}; known: {', '.join(sorted(known))}")
        if not isinstance(model, WallModel):
            raise SceneError(
                f"the wall {name!r} is a model of rir.walls, not {shown(model)}"
            )
    rows = {}
    for row, wall in enumerate(WALLS):
        keys = (wall, "walls" if wall[0] in "xy" else "all", "all")
        found = [walls[key] for key in keys if key in walls]
        if found:
            rows[row] = found[0]
    return rows


def check_walls(walls: Mapping[int, WallModel], surfaces: int) -> None:
    """Raise `SceneError` unless rows of surfaces are mapped to models of walls."""
    rows = range(surfaces)
    if not all(
        row in rows and isinstance(wall, WallModel) for row, wall in walls.items()
    ):
        raise SceneError(
            f"walls maps rows of surfaces (0…{surfaces - 1}) to models of rir.walls,"
            f" not {shown(walls)}"
        )


def resolve_surfaces(names: Sequence[str], materials: Any) -> Shares:
    """Return absorption, scattering, transmission, each (surfaces, bands), and walls.

    The walls are the models, by row, of surfaces that answer by angle.

    Parameters
    ----------
    names : sequence of str
        Names of the surfaces, as the mesh states them.
    materials : str, float, mapping or None
        One material for all: a name of the bundled table, an absorption, or a
        mapping with ``absorption``, ``scattering``, ``transmission``; or a mapping
        from surface name (or a pattern such as ``seat*``, or "all") to such. A
        surface that nothing names is looked up in the bundled table under its own name.

    Raises
    ------
    SceneError
        If a surface gets no material; lists all such.

    Examples
    --------
    >>> absorption, *_ = resolve_surfaces(["floor", "brick"], {"floor": 0.5})
    >>> absorption[:, 0].tolist()
    [0.5, 0.03]
    """
    if not isinstance(materials, str | int | float | Mapping | type(None)):
        raise SceneError(
            f"materials cannot be {shown(materials)}; give one absorption, a name of"
            " the bundled table, or a mapping from surface to such"
        )
    by_name = _by_name(names, materials)
    if not all(isinstance(name, str) for name in by_name):
        raise SceneError(
            f"surfaces are named by text, not as in {shown(materials)}; the mesh has"
            f" {_listed(names)}"
        )
    unused = [
        key
        for key in by_name
        if key not in (*names, *_ANY) and not any(fnmatchcase(n, key) for n in names)
    ]
    if unused:
        raise SceneError(
            f"no surface {', '.join(map(repr, sorted(unused)))} in the mesh;"
            f" it has {_listed(names)}"
        )
    missing = [name for name in names if _find(name, by_name) is None]
    if missing:
        raise SceneError(
            f"no material is stated for {', '.join(map(repr, missing))}; give"
            ' materials={"all": ...}, or names of the bundled table: '
            + ", ".join(sorted(load_materials()))
        )
    rows = [_surface(name, _find(name, by_name)) for name in names]
    walls = {row: one.wall_model for row, one in enumerate(rows)}
    return (
        np.array([one.absorption_per_band for one in rows]),
        np.array([one.scattering_per_band for one in rows]),
        np.array([one.transmission_per_band for one in rows]),
        {row: wall for row, wall in walls.items() if wall is not None},
    )


def resolve_seats(names: Sequence[str], materials: Any) -> tuple[SeatRows | None, ...]:
    """Return the rows of seats that each surface stands for, None where it does not.

    Where nothing is stated of seats, a name may say it, see `rir.seats.names_seats`.

    Parameters
    ----------
    names, materials
        As `resolve_surfaces` has accepted them.

    Examples
    --------
    >>> seats = resolve_seats(["stalls", "floor"], {"stalls": {
    ...     "absorption": 0.6, "seats": True}, "all": 0.1})
    >>> [rows and rows.back_m for rows in seats]
    [0.8, None]
    """
    return tuple(
        SeatRows() if _seats_by_name(name, surface) else surface.seat_rows
        for name, surface in _stated(names, materials)
    )


def notes_on_seats(names: Sequence[str], materials: Any) -> tuple[str, ...]:
    """Return a note on surfaces that are taken for rows of seats by name alone.

    Parameters
    ----------
    names, materials
        As `resolve_surfaces` has accepted them.

    Examples
    --------
    >>> notes_on_seats(["stalls", "floor"], 0.3)
    ('stalls: taken for rows of seats by name; `seats: false` says otherwise',)
    """
    stated = _stated(names, materials)
    named = [name for name, surface in stated if _seats_by_name(name, surface)]
    told = "taken for rows of seats by name; `seats: false` says otherwise"
    return (f"{', '.join(named)}: {told}",) if named else ()


def _stated(names: Sequence[str], materials: Any) -> list[tuple[str, Surface]]:
    """Return each surface's name and what is stated of it."""
    by_name = _by_name(names, materials)
    return [(name, _surface(name, _find(name, by_name))) for name in names]


def _seats_by_name(name: str, surface: Surface) -> bool:
    silent = surface.seats is None and surface.seat_rows is None
    return silent and names_seats(name)


def _by_name(names: Sequence[str], materials: Any) -> Mapping[Any, Any]:
    if isinstance(materials, Mapping) and _is_table(names, materials):
        return materials
    return {} if materials is None else {"all": materials}


def _listed(names: Sequence[str]) -> str:
    return ", ".join(map(repr, names))


def _is_table(names: Sequence[str], materials: Mapping[Any, Any]) -> bool:
    """Tell a mapping of surfaces from the description of a single material."""
    own = set(Surface.model_fields)
    return not set(materials) <= own or bool(set(materials) & set(names))


def _find(name: str, by_name: Mapping[str, Any]) -> Any:
    patterns = [key for key in by_name if fnmatchcase(name, key)]
    for key in (name, *patterns, *_ANY):
        if key in by_name:
            return by_name[key]
    return name if name in load_materials() else None


def _surface(name: str, material: Any) -> Surface:
    """Return what one surface does to sound."""
    if isinstance(material, int | float):
        material = {"absorption": material}
    elif isinstance(material, str):
        material = {"material": material}
    if not isinstance(material, Mapping):
        raise SceneError(
            f"the material of {name!r} cannot be {shown(material)}; give one"
            " absorption, a name of the bundled table, or absorption and scattering"
            " per octave"
        )
    entry = {key: _plain(value) for key, value in material.items()}
    return validate(entry, Surface, origin=f"surface {name!r}")


def _plain(value: Any) -> Any:
    """Return arrays as lists: what a configuration is made of."""
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value
