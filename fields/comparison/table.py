"""Tables and plots of a comparison: means and spreads beside baselines and floors."""

import time
from pathlib import Path
from typing import Any

import numpy as np

from fields.comparison.config import CompareConfig
from fields.comparison.sets import DividedSet, jitter_floor
from fields.convergence import AT_REST, late_fall
from fields.evaluate import Scores, chance_scores, compare_rows, score, score_units
from fields.plan import TrainingPlan
from fields.results import ResultTable
from fields.run import train_on
from fields.watching import plot_curves

__all__ = ["comparison_table", "convergence_note", "plot_comparison"]

BASELINES = {"nearest": "none", "nearest exchange": "double", "linear": "none"}
CHECKS = {
    "train C50": "dB",
    "spread C50": "dB",
    "swap C50": "dB",
    "swap STFT*": "",
    "front-to-back": "dB",
    "true front-to-back": "dB",
    "pattern error": "",
}
LINES = ("nearest", "chance")


def comparison_table(
    config: CompareConfig, divided: DividedSet, rows: list[dict[str, Any]]
) -> ResultTable:
    """Return the table of one set: methods, baselines, chance and jitter floor.

    Parameters
    ----------
    config : CompareConfig
        The comparison.
    divided : DividedSet
        The set.
    rows : list of dict
        What :func:`fields.comparison.run.run_job` returned, one a training.
    """
    table = ResultTable(f"{config.title}: {divided.name}", divided.mark)
    for method, mine in _by_method(rows).items():
        seconds = float(np.mean([row["seconds"] for row in mine]))
        table.add(method, _mean(mine), **_checks(mine), seconds=seconds)
    for name, exchange in BASELINES.items():
        started = time.process_time()
        plan = TrainingPlan(exchange=exchange)
        field = train_on(divided.train, name.split()[0], {}, plan)
        found = score(field, divided.test)
        table.add(name, found, seconds=time.process_time() - started)
    table.add("chance", chance_scores(divided.test))
    _add_floor(table, config, divided)
    table.checks = {
        name: unit
        for name, unit in CHECKS.items()
        if any(name in row for row in table.rows)
    }
    seeds = ", ".join(map(str, config.seeds))
    table.notes.append(
        f"{len(divided.train)} training rows, {len(divided.test)} rows of unseen "
        f"emitters; mean over seeds {seeds}, spread is their standard deviation; "
        "swap: answers compared with those for exchanged ends; train C50: the "
        "difference at training rows"
    )
    table.notes.append(convergence_note(rows))
    return table


def convergence_note(rows: list[dict[str, Any]]) -> str:
    """Say which trainings had not come to rest when their budget ended."""
    moving, short = [], []
    for method, mine in _by_method(rows).items():
        histories = [row["report"].get("history") for row in mine]
        # What is fitted and not trained keeps no losses.
        if all(history is None for history in histories):
            continue
        fall = _average([late_fall(history or []) for history in histories])
        if fall > AT_REST:
            moving.append(f"{method} ({100 * fall:.0f} %)")
        elif not np.isfinite(fall):
            short.append(method)
    told = []
    if moving:
        told.append(
            "NOT converged in the budget, the loss still fell in the last quarter: "
            + ", ".join(moving)
        )
    if short:
        told.append("NOT converged, stopped after a few steps: " + ", ".join(short))
    return "; ".join(told) or "every training had converged: its loss was at rest"


def _add_floor(table: ResultTable, config: CompareConfig, divided: DividedSet) -> None:
    floor = jitter_floor(divided, config.jitter_m)
    if floor is None:
        table.notes.append("no floor by position jitter: the set cannot be simulated")
        return
    rows = np.linspace(0, len(divided.test) - 1, len(floor)).astype(int)
    truth = divided.test.responses[rows]
    found = compare_rows(truth, floor.responses, divided.test.frame.sample_rate)
    table.add(f"truth, places off by {1e3 * config.jitter_m:g} mm", found)


def _by_method(rows: list[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    methods = dict.fromkeys(row["method"] for row in rows)
    return {name: [row for row in rows if row["method"] == name] for name in methods}


def _mean(rows: list[dict[str, Any]]) -> Scores:
    return {
        name: _average([row.get(name, np.nan) for row in rows])
        for name in score_units()
    }


def _checks(rows: list[dict[str, Any]]) -> dict[str, float]:
    found = {
        f"spread {name}": float(np.std([row.get(name, np.nan) for row in rows]))
        for name in score_units()
    }
    found |= {
        f"swap {name}": _average([row["swap"].get(name, np.nan) for row in rows])
        for name in score_units()
    }
    found["swap seen C50"] = _average(
        [row.get("swap seen", {}).get("C50", np.nan) for row in rows]
    )
    found["train C50"] = _average(
        [row.get("train", {}).get("C50", np.nan) for row in rows]
    )
    known = dict.fromkeys(name for row in rows for name in row["pattern"])
    for name in known:
        found[name] = _average([row["pattern"].get(name, np.nan) for row in rows])
    return found


def _average(values: list[float]) -> float:
    held = [value for value in values if np.isfinite(value)]
    return float(np.mean(held)) if held else float("nan")


def plot_comparison(path: Path, table: ResultTable, rows: list[dict[str, Any]]) -> None:
    """Draw each metric against the seconds of training, mean over the seeds."""
    curves = {name: _curve(mine) for name, mine in _by_method(rows).items()}
    lines = {row["method"]: row for row in table.rows if row["method"] in LINES}
    plot_curves(path, curves, f"{table.title} [{table.mark}]", lines)


def _curve(rows: list[dict[str, Any]]) -> list[dict[str, float]]:
    """Return what was watched, and the end, averaged over the seeds."""
    curves = [[*row["report"].get("curve", []), row] for row in rows]
    shortest = min(map(len, curves))
    names = ("seconds", *score_units())
    # Seeds that skipped a mark still share the end.
    aligned = zip(*(curve[-shortest:] for curve in curves), strict=True)
    return [
        {name: _average([one.get(name, np.nan) for one in points]) for name in names}
        for points in aligned
    ]
