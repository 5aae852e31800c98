"""What every effect is: a name, a judgement of when it matters, and an action."""

from collections.abc import Callable
from dataclasses import dataclass, field

from rooms.scene import Scene
from rooms.sound import Budget, Sound

__all__ = ["Effect", "Tolerance", "Verdict"]


@dataclass(frozen=True)
class Tolerance:
    """Largest errors that leaving effects off may cause.

    The defaults are the just-noticeable differences of ISO 3382-1:2009, table A.1
    (1 dB, 5 % of the reverberation time, 1 dB of clarity, 5 % of EDT).
    """

    level_db: float = 1.0
    reverberation_percent: float = 5.0
    clarity_db: float = 1.0
    early_decay_percent: float = 5.0


@dataclass(frozen=True)
class Verdict:
    """Whether a scene calls for an effect, and why.

    Parameters
    ----------
    on : bool
        Whether the effect is needed.
    reason : str
        One clause with the deciding numbers.
    errors : dict
        Predicted errors if it is left out: "level_db", "reverberation_percent", …
    """

    on: bool
    reason: str
    errors: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Effect:
    """One interchangeable part of the physics.

    Parameters
    ----------
    name : str
        Entry in the table.
    summary : str
        One line for people.
    needed : callable
        (scene, budget, tolerance) -> Verdict; cheap, never simulates.
    apply : callable
        (scene, sound) -> None; adds itself to the sound.
    """

    name: str
    summary: str
    needed: Callable[[Scene, Budget, Tolerance], Verdict]
    apply: Callable[[Scene, Sound], None]
