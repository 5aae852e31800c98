"""train-field cost: what accuracy costs in seconds, knob by knob."""

import json
import time
from pathlib import Path
from typing import Any

from fields.evaluate import METRIC_UNITS, score
from fields.plan import TrainingPlan
from fields.run import UNLIMITED_STEPS, train_on
from fields.sets import Bench

__all__ = ["measure_cost", "plot_cost"]


def measure_cost(
    bench: Bench,
    model: str,
    knob: str,
    values: list[Any],
    *,
    budgets: list[float],
    exchange: str = "double",
    seeds: tuple[int, ...] = (0,),
) -> list[dict[str, Any]]:
    """Train a model at several settings and budgets; one row each.

    Parameters
    ----------
    bench : Bench
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
    seeds : tuple of int
        Repeats.
    """
    rows = []
    for value in values or [None]:
        config = {} if value is None else {knob: value}
        for budget in budgets:
            for seed in seeds:
                plan = TrainingPlan(
                    steps=UNLIMITED_STEPS,
                    budget_s=budget,
                    exchange=exchange,
                    seed=seed,
                )
                started = time.process_time()
                field = train_on(bench.train, model, config, plan)
                seconds = time.process_time() - started
                row = {"value": value, "seconds": seconds, "seed": seed}
                rows.append(row | score(field, bench.test))
    return rows


def plot_cost(folder: Path, rows: list[dict[str, Any]], title: str) -> None:
    """Write cost.json and cost.png."""
    from matplotlib.figure import Figure

    (folder / "cost.json").write_text(
        json.dumps({"schema": 1, "title": title, "rows": rows}, indent=1)
    )
    figure = Figure(figsize=(11, 5.5), layout="constrained")
    figure.suptitle(title)
    for axes, name in zip(figure.subplots(2, 4).flat, METRIC_UNITS, strict=False):
        for value in dict.fromkeys(row["value"] for row in rows):
            mine = [row for row in rows if row["value"] == value]
            seconds = [row["seconds"] for row in mine]
            axes.loglog(seconds, [row[name] for row in mine], "o-", label=str(value))
        axes.set_title(f"{name} {METRIC_UNITS[name]}", fontsize="small")
        axes.set_xlabel("CPU s")
    figure.axes[0].legend(fontsize="x-small")
    figure.savefig(folder / "cost.png", dpi=110)
