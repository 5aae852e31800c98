"""What a simulation's parameters may be wrong by: chance, work, effects off, data."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray
from rooms.effects import Tolerance
from rooms.effects.handover import missing_energy
from rooms.geometry import Shoebox
from rooms.mean_decay import images_error
from rooms.plan import EffectPlan, plan_effects
from rooms.predict import differences, equivalent_box, predict_parameters
from rooms.scene import Scene
from rooms.sound import Budget
from rooms.wave_chance import independent_pairs, waves_errors
from rooms.work import mixed_error

__all__ = ["ERROR_KINDS", "stated_errors", "together", "waves_error"]

ERROR_KINDS: tuple[str, ...] = (
    "level_db",
    "clarity_db",
    "reverberation_percent",
    "early_decay_percent",
)

_ABSORPTION, _ABSORPTION_LEAST = 0.1, 0.01
"""Standard error of an absorption coefficient, as a share of it and at least: so far do
laboratories stray that measure one specimen after ISO 354 (ISO 12999-2:2020), and
tables of materials further."""

_SCATTERING = 0.05
"""Standard error of a scattering coefficient: the step in which they are tabulated
(ISO 17497-1:2004, annex A, states errors of that size)."""

_UNTOLD = 100.0
"""Percent for a decay that the response is too short to tell."""

_ENDLESS = 1000.0
"""Lengths of the response after which a decay counts as over: its errors are whole by
then, and without any loss it would never be."""

_MOST_MATERIALS = 6
"""Materials whose errors are told apart; those of the others stray as one."""


def together(parts: Iterable[Mapping[str, float]]) -> dict[str, float]:
    """Return independent standard errors taken together: the root of summed squares.

    Examples
    --------
    >>> together([{"level_db": 0.3}, {"level_db": 0.4}])["level_db"]
    0.5
    """
    total: dict[str, float] = dict.fromkeys(ERROR_KINDS, 0.0)
    for part in parts:
        for kind, error in part.items():
            if kind in total and np.isfinite(error):
                total[kind] = float(np.hypot(total[kind], error))
    return total


def stated_errors(
    scene: Scene, plan: EffectPlan, budget: Budget, sampling: Mapping[str, float]
) -> dict[str, dict[str, float]]:
    """Return standard errors of the parameters by cause and kind.

    Parameters
    ----------
    scene : Scene
        What was simulated.
    plan : EffectPlan
        Effects that were on, and how finely.
    budget : Budget
        Length, order and rays.
    sampling : mapping
        Standard errors by chance, from the rays themselves.

    Returns
    -------
    dict
        "sampling": rays; "waves": the draw of late sound, at a single pair; "order":
        reflections that are listed no longer, or traced no longer for each pair, or
        lost; "length": what comes after the end of the response; "left off": effects
        that are off, as predicted by the planner; "wall data": absorption and
        scattering, whose own errors are guessed from those of laboratories; "volume":
        that of an open mesh. Each maps kinds ("level_db", "clarity_db",
        "reverberation_percent", "early_decay_percent") to the worst octave.

    References
    ----------
    ISO 12999-2:2020 and ISO 17497-1:2004, for the errors of wall data.
    """
    made = plan.stage(scene)
    expected = plan.expected(scene)
    scene = plan.stage(scene)
    return {
        "sampling": together([sampling]),
        "waves": waves_error(made, plan, budget),
        "order": together([_order(made, plan, budget)]),
        "length": together([_length(expected, budget)]),
        "left off": together(_left_off(scene, plan, budget)),
        "wall data": together(_wall_data(expected, budget)),
        "volume": together(_volume(made, expected, budget)),
    }


def waves_error(
    made: Scene,
    plan: EffectPlan,
    budget: Budget,
    places: tuple[FloatArray, FloatArray] | None = None,
) -> dict[str, float]:
    """Return what parameters stray by because waves are drawn, the worst octave.

    Parameters
    ----------
    made : Scene
        What was simulated, as the plan stages it.
    plan : EffectPlan
        Effects that were on.
    budget : Budget
        Length, order and rays.
    places : tuple of ndarray, shape (n, 3), optional
        Emitters and listeners [m]: the error of the mean of all their pairs. That of a
        single pair when left out.
    """
    errors = waves_errors(made, plan, budget)
    if places is not None:
        errors = errors / np.sqrt(
            independent_pairs(*places, made.speed_of_sound / made.bands)
        )
    heard = _heard(made, budget)
    worst = np.max(np.nan_to_num(errors[:, heard]), axis=1, initial=0.0)
    return together([dict(zip(ERROR_KINDS, worst.tolist(), strict=True))])


def _heard(scene: Scene, budget: Budget) -> NDArray[np.bool_]:
    return scene.bands < budget.sample_rate / 2


def _order(scene: Scene, plan: EffectPlan, budget: Budget) -> dict[str, float]:
    """Return what waves in place of images change, or orders left out."""
    if "specular" not in plan.on:
        return {}
    if "late" not in plan.on:
        return missing_energy(scene, budget)
    if not scene.geometry.lattice or budget.rays is not None:
        if plan.work.traced_until >= budget.duration:
            return {}  # rays carry on exactly, but for their chance
        size = budget.sample_rate, budget.n_samples, budget.max_order
        return mixed_error(scene, *size, tuple(plan.on), plan.work.traced_until)
    free = 4 * scene.geometry.volume / scene.geometry.areas.sum()
    order = np.inf if budget.max_order is None else budget.max_order
    until = min(order * free / scene.speed_of_sound, plan.work.images_until)
    return images_error(scene, budget, until) if until < budget.duration else {}


def _length(scene: Scene, budget: Budget) -> dict[str, float]:
    """Return what the end of the response changes against a whole decay."""
    whole = max(1.2 * float(scene.eyring_t60().max()), budget.duration)
    whole = min(whole, _ENDLESS * budget.duration)
    if whole <= budget.duration:
        return {}
    heard = _heard(scene, budget)
    full = predict_parameters(scene, whole)
    cut = predict_parameters(scene, whole, until=budget.duration)
    errors = differences(full, cut, heard)
    for kind, one, other in (
        ("reverberation_percent", full.reverberation, cut.reverberation),
        ("early_decay_percent", full.early_decay, cut.early_decay),
    ):
        if np.any(np.isfinite(one) & ~np.isfinite(other) & heard):
            errors[kind] = _UNTOLD
    return errors


def _left_off(scene: Scene, plan: EffectPlan, budget: Budget) -> list[dict[str, float]]:
    """Return the planner's predictions for effects that are off."""
    off = {name for name, verdict in plan.verdicts.items() if not verdict.on}
    judged = plan.verdicts
    if not any(verdict.errors for verdict in judged.values()):
        judged = plan_effects(
            scene,
            sample_rate=budget.sample_rate,
            duration=budget.duration,
            max_order=budget.max_order,
            rays=budget.rays,
            only=plan.on,
            tolerance=Tolerance(),
        ).verdicts
    return [judged[name].errors for name in off if name in judged]


def _wall_data(scene: Scene, budget: Budget) -> list[dict[str, float]]:
    """Return what the error of each material's absorption and of scattering changes."""
    box = equivalent_box(scene)
    rows, member = np.unique(box.absorption, axis=0, return_inverse=True)
    member = np.minimum(member.reshape(-1), _MOST_MATERIALS - 1)
    stray = np.maximum(_ABSORPTION * box.absorption, _ABSORPTION_LEAST)
    changed = []
    for material in range(min(len(rows), _MOST_MATERIALS)):
        some = (member == material)[:, None]
        more = np.clip(box.absorption + np.where(some, stray, 0.0), 0.0, 1.0)
        changed.append(replace(box, absorption=more))
    if np.any(box.scattering):
        spread = np.where(box.scattering > 0, box.scattering + _SCATTERING, 0.0)
        changed.append(replace(box, scattering=np.clip(spread, 0.0, 1.0)))
    return _changes(box, changed, budget)


def _volume(made: Scene, scene: Scene, budget: Budget) -> list[dict[str, float]]:
    """Return what the error of an open mesh's volume changes."""
    error = made.geometry.volume_error / max(made.geometry.volume, 1e-9)
    if not error:
        return []
    box = equivalent_box(scene)
    larger = Shoebox((1 + error) ** (1 / 3) * box.geometry.size)
    return _changes(box, [replace(box, geometry=larger)], budget)


def _changes(
    box: Scene, changed: Iterable[Scene], budget: Budget
) -> list[dict[str, float]]:
    full = predict_parameters(box, budget.duration)
    return [
        differences(
            full, predict_parameters(each, budget.duration), _heard(box, budget)
        )
        for each in changed
    ]
