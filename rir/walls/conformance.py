"""What every wall model promises; run it on your own by its name."""

import numpy as np

from rir.conformance import promise, refusal
from rir.errors import ConfigError
from rir.walls.kinds import WALL_MODELS, read_wall
from rir.walls.reflection import pressure_factor, random_incidence
from rir.walls.wall_model import WallModel

__all__ = ["check_wall_model"]

_ROUNDING = 1e-9
"""How far a wall may give back more than it got."""


def check_wall_model(name: str) -> None:
    """Check that a wall model of the table answers every angle and gives no energy.

    Parameters
    ----------
    name : str
        Name in the table of wall models.

    Raises
    ------
    AssertionError
        If a promise is broken; names it.
    """
    kind = WALL_MODELS[name]
    promise(kind.name == name, f"{name} calls itself as the table does")
    promise(kind.summary, f"{name} says in a line what it is")
    wall = read_wall(name, dict(kind.example))
    promise(isinstance(wall, WallModel), f"{name} answers as a wall model")
    unknown = {**kind.example, "no_such_setting": 1}
    refusal(ConfigError, lambda: read_wall(name, unknown))
    f, cosine = np.geomspace(16, 20000, 60)[:, None], np.linspace(0.01, 1, 25)
    admittance = wall.admittance(f, cosine)
    promise(admittance.shape == (60, 25), f"{name} broadcasts frequencies and cosines")
    promise(np.all(np.isfinite(admittance)), f"{name} answers with numbers")
    promise(np.all(admittance.real >= 0), f"{name} is no source of sound")
    alike = np.allclose(admittance, admittance[:, -1:])
    promise(alike or not wall.locally_reacting, f"{name} reacts locally if it says so")
    kept = np.abs(pressure_factor(wall, f, cosine))
    promise(np.all(kept <= 1 + _ROUNDING), f"{name} returns no more than it gets")
    share = random_incidence(wall, f[:, 0])
    promise(np.all(share <= 1 + _ROUNDING), f"{name} absorbs a share of diffuse sound")
