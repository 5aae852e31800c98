"""What every effect is: a name, a judgement of when it matters, and an action."""

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, field

from rir.numbers import read_number
from rooms.scene import Scene
from rooms.sound import Budget, Sound

__all__ = ["Effect", "Need", "Tolerance", "judged"]

_MARGIN = 0.25
"""Predictions are means over a room, and single places, where decays are slower or
the direct sound is stronger, stray by up to four times (benchmarks/planner_honesty)."""

_ROUNDED = 1e-9
"""Errors that rounding makes, which a tolerance of nothing allows."""

_UNITS = {
    "level_db": ("level", "dB"),
    "reverberation_percent": ("T60", "%"),
    "clarity_db": ("C50", "dB"),
    "early_decay_percent": ("EDT", "%"),
}


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

    def __post_init__(self) -> None:
        for kind in _UNITS:
            limit = getattr(self, kind)
            what = f"the tolerance of {_UNITS[kind][0]} [{_UNITS[kind][1]}]"
            object.__setattr__(
                self,
                kind,
                limit
                if isinstance(limit, float) and limit == math.inf
                else read_number(limit, what, least=0),
            )

    @classmethod
    def of(cls, limits: dict[str, float]) -> "Tolerance":
        """Return a tolerance of the kinds that are limited; all else may be anything.

        Examples
        --------
        >>> Tolerance.of({"clarity_db": 0.5}).level_db
        inf
        """
        return cls(**{kind: limits.get(kind, math.inf) for kind in _UNITS})

    def excess(self, errors: dict[str, float], share: float) -> float:
        """Return the largest error as a multiple of its share of the tolerance."""
        limits = asdict(self)
        least = 1e-9  # nothing is allowed, and errors of rounding are none
        return max(
            (
                error / max(share * limits[kind], least)
                for kind, error in errors.items()
            ),
            default=0.0,
        )

    def exceeded(self, errors: dict[str, float]) -> list[str]:
        """Return the kinds of error that predictions come too close to."""
        limits = asdict(self)
        return [
            kind
            for kind, error in errors.items()
            if error > _MARGIN * limits.get(kind, float("inf"))
        ]


@dataclass(frozen=True)
class Need:
    """Whether a scene calls for an effect, and why."""

    on: bool
    """Whether the effect is needed."""
    reason: str
    """One clause with the deciding numbers."""
    errors: dict[str, float] = field(default_factory=dict)
    """Predicted errors if it is left out: "level_db", "reverberation_percent", …"""
    cost_s: float = 0.0
    """Estimated processor time for one pair [s]."""

    @property
    def shown_errors(self) -> str:
        """The predicted errors in words."""
        parts = [
            f"{_UNITS[kind][0]} {error:.2g} {_UNITS[kind][1]}"
            for kind, error in self.errors.items()
            if kind in _UNITS and error == error and error != float("inf")
        ]
        return ", ".join(parts) or ("everything" if self.errors else "none")


def _whole(errors: dict[str, float]) -> dict[str, float]:
    """Return errors of all kinds: those unsaid are as noticeable as that of level."""
    if "level_db" not in errors:
        return errors
    just = asdict(Tolerance())
    level = errors["level_db"] / just["level_db"]
    return {kind: level * limit for kind, limit in just.items()} | errors


def judged(
    tolerance: Tolerance, errors: dict[str, float], why: str, cost_s: float = 0.0
) -> Need:
    """Return the need that predicted errors make."""
    over = tolerance.exceeded(_whole(errors))
    names = ", ".join(_UNITS[kind][0] for kind in over)
    reason = f"{why}: needed for {names}" if over else f"{why}: below the tolerance"
    return Need(bool(over), reason, errors, cost_s)


def _as_it_is(scene: Scene) -> Scene:
    return scene


@dataclass(frozen=True)
class Effect:
    """One interchangeable part of the physics."""

    name: str
    """Entry in the table."""
    summary: str
    """One line for people."""
    needed: Callable[[Scene, Budget, Tolerance], Need]
    """(scene, budget, tolerance) -> Need; cheap, never simulates."""
    apply: Callable[[Scene, Sound], None]
    """(scene, sound) -> None; adds itself to the sound."""
    stage: Callable[[Scene], Scene] = _as_it_is
    """What the scene is for the effects that follow, once this one is on."""
    within: Callable[[Scene], Scene] = _as_it_is
    """A scene whose mean flow of energy is that with the effect on, for predictions."""
    without: Callable[[Scene], Scene] = _as_it_is
    """A scene whose mean flow of energy is that with the effect off."""
    after: str = ""
    """Effect that this one is applied right after; the last one when empty. Only
    effects of other packages need it: ours stand in their order."""
