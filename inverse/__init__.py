"""A room out of its responses: walls, devices and late sound, without training.

Names are loaded on first use, so that commands start fast.
"""

from typing import TYPE_CHECKING

from rir.lazy import lazy_names

if TYPE_CHECKING:
    from inverse.acoustics import Acoustics
    from inverse.find import find_room
    from inverse.plan.ground_plan import GroundPlan, plan_of
    from inverse.rows.fitset import FitSet
    from inverse.rows.reading import read_rows
    from inverse.search import PriorKnowledge, SearchSettings

__all__ = [
    "Acoustics",
    "FitSet",
    "GroundPlan",
    "PriorKnowledge",
    "SearchSettings",
    "find_room",
    "plan_of",
    "read_rows",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "inverse.acoustics": "Acoustics",
        "inverse.find": "find_room",
        "inverse.plan.ground_plan": "GroundPlan plan_of",
        "inverse.rows.fitset": "FitSet",
        "inverse.rows.reading": "read_rows",
        "inverse.search": "PriorKnowledge SearchSettings",
    },
)
