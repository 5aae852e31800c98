"""Which effects a scene calls for, and why."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rooms.effects import EFFECTS, Need, Tolerance
from rooms.request import check_kind, check_names, make_budget
from rooms.scene import Scene
from rooms.sound import Budget, Work
from rooms.work import choose_work

__all__ = ["EffectPlan", "plan_effects"]


@dataclass(frozen=True)
class EffectPlan:
    """Need on each effect, in order of application.

    Parameters
    ----------
    verdicts : dict
        Effect name to `Need`.
    tolerance : Tolerance
        What the verdicts had to meet.
    work : Work
        How finely the effects that are on are computed.
    """

    verdicts: dict[str, Need]
    tolerance: Tolerance
    work: Work = field(default_factory=Work)

    @property
    def on(self) -> list[str]:
        """Names of the effects that are on, in order of application."""
        return [name for name, verdict in self.verdicts.items() if verdict.on]

    def expected(self, scene: Scene) -> Scene:
        """Return a scene whose mean flow of energy is the plan's, for predictions."""
        for name, verdict in self.verdicts.items():
            effect = EFFECTS[name]
            if verdict.on:
                scene = effect.within(effect.stage(scene))
            else:
                scene = effect.without(scene)
        return scene

    def stage(self, scene: Scene) -> Scene:
        """Return the scene as the effects that are on make it, to be simulated."""
        for name in self.on:
            scene = EFFECTS[name].stage(scene)
        return scene


def plan_effects(
    scene: Scene,
    *,
    sample_rate: int = 48000,
    duration: float = 0.5,
    max_order: int | None = None,
    rays: int | None = None,
    tolerance: Tolerance | None = None,
    only: Sequence[str] | None = None,
    without: Sequence[str] | None = (),
    everything: bool = False,
    judge: bool = True,
) -> EffectPlan:
    """Judge every effect for a scene.

    Parameters
    ----------
    scene : Scene
        What is to be simulated.
    sample_rate : int
        Samples per second [Hz].
    duration : float
        Length of the response [s].
    max_order : int, optional
        Highest order of listed reflections.
    rays : int, optional
        Rays per pair, if they are to be traced.
    tolerance : Tolerance, optional
        Largest errors allowed; the just-noticeable differences of ISO 3382.
    only, without : sequence of str
        Override: exactly these; all but these.
    everything : bool
        Override: all effects.
    judge : bool
        Whether to predict errors even where `only` has decided.

    Raises
    ------
    UnknownNameError
        If an override names no effect.
    SignalError
        If rate, duration, order or rays are no such numbers.

    Examples
    --------
    >>> plan_effects(Scene.shoebox((6, 5, 3)), duration=0.1, sample_rate=4000).on
    ['direct', 'specular']
    """
    check_kind(scene, Scene, "a scene", "build one by Scene.shoebox or Scene.from_mesh")
    tolerance = Tolerance() if tolerance is None else tolerance
    check_kind(tolerance, Tolerance, "a tolerance", "write Tolerance(level_db=0.5)")
    check_names(only, "effects")
    check_names(without, "effects left out")
    without = () if without is None else without
    for value, what in ((everything, "everything"), (judge, "judge")):
        check_kind(value, (bool, np.bool_), what, "give True or False")
    budget = make_budget(sample_rate, duration, max_order, rays)
    for name in (*(only or ()), *without):
        EFFECTS[name]
    verdicts = {}
    for name, effect in EFFECTS.items():
        if only is not None and not judge:
            verdicts[name] = Need(name in only, "on request")
            continue
        verdict = effect.needed(scene, budget, tolerance)
        verdict = _overridden(name, verdict, only, without, everything)
        verdicts[name] = verdict
        if verdict.on:
            scene = effect.stage(scene)
    if only is not None or everything:
        return EffectPlan(verdicts, tolerance)
    return _frugal(scene, budget, EffectPlan(verdicts, tolerance))


def _frugal(scene: Scene, budget: Budget, plan: EffectPlan) -> EffectPlan:
    """Return a plan that works no finer than its tolerance asks for."""
    work = choose_work(scene, budget, plan.tolerance, plan.on)
    verdicts = dict(plan.verdicts)
    late = verdicts.get("late")
    if work.images_until < budget.duration and late is not None and not late.on:
        why = f"images are listed singly up to {1000 * work.images_until:.0f} ms"
        verdicts["late"] = Need(True, why, late.errors, late.cost_s)
    return replace(plan, verdicts=verdicts, work=work)


def _overridden(
    name: str,
    verdict: Need,
    only: Sequence[str] | None,
    without: Sequence[str],
    everything: bool,
) -> Need:
    if name in without or (only is not None and name not in only):
        return Need(False, f"left out on request ({verdict.reason})", verdict.errors)
    if not verdict.on and (everything or only is not None):
        return Need(True, f"asked for ({verdict.reason})", verdict.errors)
    return verdict
