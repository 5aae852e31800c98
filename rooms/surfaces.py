"""Give the surfaces of a mesh their materials."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rir.config import validate
from rir.errors import SceneError
from rir.materials import load_materials
from rir.physics import octave_centers
from rir.room import Surface

__all__ = ["Shares", "resolve_surfaces"]

FloatArray = NDArray[np.float64]
Shares = tuple[FloatArray, FloatArray, FloatArray]
_BANDS = len(octave_centers(125.0, 8000.0))
_ANY = ("all", "default")


def resolve_surfaces(names: Sequence[str], materials: Any) -> Shares:
    """Return absorption, scattering and transmission, each (surfaces, bands).

    Parameters
    ----------
    names : sequence of str
        Names of the surfaces, as the mesh states them.
    materials : str, float, mapping or None
        One material for all: a name of the bundled table, an absorption, or a
        mapping with ``absorption``, ``scattering``, ``transmission``; or a mapping
        from surface name (or "all") to such. A surface that nothing names is
        looked up in the bundled table under its own name.

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
    by_name = materials if _is_table(names, materials) else {"all": materials}
    if materials is None:
        by_name = {}
    unused = set(by_name) - set(names) - set(_ANY)
    if unused:
        raise SceneError(
            f"no surface {', '.join(map(repr, sorted(unused)))} in the mesh;"
            f" it has {', '.join(map(repr, names))}"
        )
    missing = [name for name in names if _find(name, by_name) is None]
    if missing:
        raise SceneError(
            f"no material is stated for {', '.join(map(repr, missing))}; give"
            ' materials={"all": ...}, or names of the bundled table: '
            + ", ".join(sorted(load_materials()))
        )
    rows = [_shares(name, _find(name, by_name)) for name in names]
    absorption, scattering, transmission = (
        np.array(part) for part in zip(*rows, strict=True)
    )
    return absorption, scattering, transmission


def _is_table(names: Sequence[str], materials: Any) -> bool:
    """Tell a mapping of surfaces from the description of a single material."""
    if not isinstance(materials, Mapping):
        return False
    own = {"absorption", "scattering", "transmission", "material"}
    return not set(materials) <= own or bool(set(materials) & set(names))


def _find(name: str, by_name: Mapping[str, Any]) -> Any:
    for key in (name, *_ANY):
        if key in by_name:
            return by_name[key]
    return name if name in load_materials() else None


def _shares(name: str, material: Any) -> Shares:
    if isinstance(material, int | float):
        material = {"absorption": float(material)}
    entry = {"material": material} if isinstance(material, str) else dict(material)
    passed = np.broadcast_to(np.asarray(entry.pop("transmission", 0.0)), _BANDS)
    surface = validate(entry, Surface, origin=f"surface {name!r}")
    return surface.absorption_per_band, surface.scattering_per_band, passed
