"""Walls that reflect differently at different angles, as rooms ask for them."""

from rooms.walls.angled import AngledWalls, angled_walls, octave_factors
from rooms.walls.echoes import spread_echoes
from rooms.walls.spherical import spherical_factor

__all__ = [
    "AngledWalls",
    "angled_walls",
    "octave_factors",
    "spherical_factor",
    "spread_echoes",
]
