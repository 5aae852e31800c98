"""What walls do to plane waves: the only place that knows it.

Rooms, rays, wave grids and fits ask a `WallModel` for its admittance, and
`rir.walls.reflection` for what follows from it.
"""

from rir.walls.admittance import Admittance, Impedance, real_admittance
from rir.walls.kinds import WALL_MODELS, WallKind, read_wall
from rir.walls.layers import AirGap, LayeredWall, OneLayer, Panel, Perforated, Porous
from rir.walls.reflection import (
    octave_frequencies,
    pressure_factor,
    random_incidence,
    random_incidence_octaves,
)
from rir.walls.wall_model import WallModel

__all__ = [
    "WALL_MODELS",
    "Admittance",
    "AirGap",
    "Impedance",
    "LayeredWall",
    "OneLayer",
    "Panel",
    "Perforated",
    "Porous",
    "WallKind",
    "WallModel",
    "octave_frequencies",
    "pressure_factor",
    "random_incidence",
    "random_incidence_octaves",
    "read_wall",
    "real_admittance",
]
