"""The bundled table of surface materials."""

from functools import cache
from importlib.resources import files
from typing import Any

from rir.config import parse_yaml
from rir.registry import Registry

__all__ = ["load_materials"]


@cache
def load_materials() -> Registry[dict[str, Any]]:
    """Return the material table: name to absorption and scattering per octave.

    The octaves are 125 Hz to 8 kHz; sources stand at the top of
    ``materials.yaml``. Materials that stand for rows of seats have ``seats``, the
    fields of `rir.room.SeatRows`.

    Examples
    --------
    >>> load_materials()["open_window"]["absorption"][0]
    1.0
    """
    table: Registry[dict[str, Any]] = Registry("material")
    text = files("rir").joinpath("materials.yaml").read_text(encoding="utf-8")
    for name, entry in parse_yaml(text, origin="materials.yaml").items():
        table.add(name)(entry)
    return table
