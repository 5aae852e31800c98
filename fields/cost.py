"""train-field cost: what accuracy costs in seconds, knob by knob."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from fields.comparison.sets import DividedSet
from fields.evaluate import score, score_units
from fields.field import Field
from fields.plan import TrainingPlan
from fields.run import UNLIMITED_STEPS, train_on
from rir.cost import CostCurve, measure_costs

__all__ = ["measure_training"]

Setting = tuple[Any, float]


def measure_training(
    divided: DividedSet,
    model: str,
    knob: str,
    values: Sequence[Any],
    *,
    budgets: Sequence[float],
    exchange: str = "double",
    repeats: int = 1,
    seed: int = 0,
) -> list[CostCurve]:
    """Train a model at several settings and budgets; one curve for each metric.

    Parameters
    ----------
    divided : DividedSet
        Data.
    model : str
        A name in ``FIELDS``.
    knob : str
        Setting of the model that is turned, such as rays or width; "" turns
        none.
    values : list
        Its values.
    budgets : list of float
        CPU seconds of training.
    exchange : str
        none, flip or double.
    repeats : int
        Trainings of each setting, from other random weights.
    seed : int
        Key of everything random.

    Returns
    -------
    list of CostCurve
        In the order of the metrics; seconds are those of the whole training.
    """

    def run(setting: Setting, rng: np.random.Generator) -> Field:
        value, budget = setting
        plan = TrainingPlan(
            steps=UNLIMITED_STEPS,
            budget_s=budget,
            exchange=exchange,
            seed=int(rng.integers(2**31)),
        )
        config = {} if value is None else {knob: value}
        return train_on(divided.train, model, config, plan)

    def name(setting: Setting) -> str:
        value, budget = setting
        return f"{budget:g} s" if value is None else f"{value}, {budget:g} s"

    return measure_costs(
        f"{model} {knob}".strip(),
        [(value, budget) for value in values or [None] for budget in budgets],
        run,
        lambda field: score(field, divided.test),
        units=score_units(),
        rng=np.random.default_rng(seed),
        repeats=repeats,
        mark=divided.mark,
        name=name,
    )
