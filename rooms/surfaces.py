"""Give the surfaces of a mesh their materials."""

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from rir.arrays import FloatArray
from rir.config import validate
from rir.errors import SceneError
from rir.materials import load_materials
from rir.numbers import shown
from rir.room import Surface
from rir.walls import WallModel

__all__ = ["Shares", "resolve_surfaces"]

Shares = tuple[FloatArray, FloatArray, FloatArray, dict[int, WallModel]]
_ANY = ("all", "default")


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
    by_name: Mapping[Any, Any] = {} if materials is None else {"all": materials}
    if isinstance(materials, Mapping) and _is_table(names, materials):
        by_name = materials
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
