"""The kinds of walls that a room may state, one entry each."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rir.config import StrictModel, validate
from rir.registry import Registry
from rir.walls.admittance import Admittance, Impedance
from rir.walls.layers import LayeredWall
from rir.walls.wall_model import WallModel

__all__ = ["WALL_MODELS", "WallKind", "read_wall"]


@dataclass(frozen=True)
class WallKind:
    """One kind of wall, as a room file states it."""

    name: str
    """Entry in the table, and key in a room file."""
    summary: str
    """One line for people."""
    model: type[StrictModel]
    """Checks the settings and answers as a `WallModel`."""
    example: Mapping[str, Any]
    """Settings of one such wall."""


WALL_MODELS: Registry[WallKind] = Registry("wall model", "resounding.walls", WallKind)
_WOOL = {"porous": {"thickness_m": 0.05, "flow_resistivity_pa_s_m2": 10000.0}}
_GAP = {"air_gap": {"thickness_m": 0.1}}
for _kind in (
    WallKind("admittance", "admittance per octave", Admittance, {"conductance": 0.2}),
    WallKind("impedance", "impedance per octave", Impedance, {"resistance": 5.0}),
    WallKind("layers", "layers on a backing", LayeredWall, {"layers": [_WOOL, _GAP]}),
):
    WALL_MODELS.add(_kind.name)(_kind)


def read_wall(name: str, settings: Any, *, origin: str = "wall") -> WallModel:
    """Return a wall of a kind of the table.

    Raises
    ------
    UnknownNameError
        If there is no such kind; lists those that are known.
    ConfigError
        With every mistake in the settings.

    Examples
    --------
    >>> read_wall("impedance", {"resistance": 2.0}).locally_reacting
    True
    """
    wall: Any = validate(settings, WALL_MODELS[name].model, origin=origin)
    return wall
