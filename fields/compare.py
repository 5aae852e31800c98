"""train-field compare: models x forms x seeds over data sets, resumable."""

import json
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field as Setting

from fields.evaluate import METRIC_UNITS, Scores, chance_scores, compare_rows, score
from fields.field import Field
from fields.plan import TrainingPlan
from fields.results import ResultTable
from fields.run import UNLIMITED_STEPS, exchange_form, train_on
from fields.sets import Bench, built_in, jitter_floor, open_bench
from rir.config import Config

__all__ = ["CompareConfig", "compare", "run_job"]

FORMS = {
    "vanilla": {},
    "exchange": {"exchange": "double"},
    "flip": {"exchange": "flip"},
    "ssl": {"self_supervised": "pattern"},
    "ssl-paper": {"self_supervised": "paper"},
    "ssl-teacher": {"self_supervised": "teacher"},
    "contrastive": {"self_supervised": "contrastive"},
}
BASELINES = ("nearest", "linear")


class SetConfig(Config):
    """One data set of a comparison."""

    name: str = ""
    scene: str = ""
    gains: str = "same"
    listeners: int = 150
    fewer: int = 1
    path: str = ""
    train_emitters: int | None = None
    test_rows: int = 600


class ModelConfig(Config):
    """One model, with the settings that differ from its own."""

    model: str
    label: str = ""
    preset: str = "cpu"
    config: dict[str, Any] = Setting(default_factory=dict)
    forms: tuple[str, ...] = ("vanilla", "exchange")
    budget_s: float | None = None


class CompareConfig(Config):
    """A comparison: every model in every form with every seed on every set."""

    title: str = "comparison"
    sets: tuple[SetConfig, ...]
    models: tuple[ModelConfig, ...]
    seeds: tuple[int, ...] = (0, 1, 2)
    budget_s: float = 20.0
    batch_size: int | None = None
    learning_rate: float = 1e-3
    weight_decay: float = 1e-2
    cache: str = "runs/sets"
    jitter_m: float = 0.003


@dataclass(frozen=True)
class Job:
    """One training of a comparison."""

    set_number: int
    model: ModelConfig
    form: str
    seed: int
    budget_s: float

    @property
    def method(self) -> str:
        """Name of the row in the table."""
        return f"{self.model.label or self.model.model} {self.form}"


def compare(
    config: CompareConfig, out: Path, tell: Callable[[str], None]
) -> list[ResultTable]:
    """Run what is missing and write one table and plot a set.

    Every job's scores are a file of their own, so that an interrupted
    comparison goes on where it stopped.
    """
    out.mkdir(parents=True, exist_ok=True)
    tables = []
    for number, one in enumerate(config.sets):
        bench = _bench(one, Path(config.cache))
        rows = [
            _job_row(config, bench, job, out, tell) for job in _jobs(config, number)
        ]
        table = _table(config, bench, rows)
        folder = out / bench.name
        folder.mkdir(exist_ok=True)
        table.save(folder)
        _plot(folder / "seconds.png", table, rows)
        tables.append(table)
    return tables


def run_job(bench: Bench, job: Job, config: CompareConfig) -> dict[str, Any]:
    """Train and score one field; returns the row."""
    form = FORMS[job.form]
    plan = TrainingPlan(
        steps=UNLIMITED_STEPS,
        budget_s=job.budget_s,
        batch_size=config.batch_size,
        learning_rate=config.learning_rate,
        weight_decay=config.weight_decay,
        exchange=exchange_form(form.get("exchange", False)),
        self_supervised=form.get("self_supervised", "none"),
        seed=job.seed,
    )
    model = job.model
    field = train_on(bench.train, model.model, model.config, plan, model.preset)
    return {
        "method": job.method,
        "seed": job.seed,
        **score(field, bench.test),
        "swap": _swap_gap(field, bench),
        "train": score(field, bench.train.rows(_spread(bench.train, 200))),
        "report": getattr(field, "report", {}),
        "seconds": job.budget_s,
    }


def _swap_gap(field: Field, bench: Bench) -> Scores:
    test = bench.test.rows(_spread(bench.test, 200))
    scale = np.float32(test.frame.scale)
    one_way = field.predict(test.emitters, test.listeners) / scale
    other = field.predict(test.listeners, test.emitters) / scale
    return compare_rows(one_way, other, test.frame.sample_rate)


def _spread(data: Any, count: int) -> np.ndarray:
    return np.linspace(0, len(data) - 1, min(len(data), count)).astype(int)


def _bench(one: SetConfig, cache: Path) -> Bench:
    path = Path(one.path) if one.path else None
    name = one.name or (path.stem if path else f"{one.scene}-{one.gains}")
    if path is None:
        path = built_in(one.scene, one.gains, one.listeners, cache, fewer=one.fewer)
    return open_bench(
        path,
        name,
        train_emitters=one.train_emitters,
        most_test_rows=one.test_rows,
        scene=one.scene,
    )


def _jobs(config: CompareConfig, number: int) -> Iterator[Job]:
    for seed in config.seeds:
        for model in config.models:
            for form in model.forms:
                budget = model.budget_s or config.budget_s
                yield Job(number, model, form, seed, budget)


def _key(config: CompareConfig, job: Job) -> str:
    from hashlib import sha256

    told = {
        "set": config.sets[job.set_number].model_dump(),
        "model": job.model.model_dump(exclude={"forms"}),
        "form": job.form,
        "budget": job.budget_s,
        "training": [config.batch_size, config.learning_rate, config.weight_decay],
    }
    digest = sha256(json.dumps(told, sort_keys=True, default=list).encode())
    return f"{job.model.model}-{job.form}-{job.seed}-{digest.hexdigest()[:12]}"


def _job_row(
    config: CompareConfig,
    bench: Bench,
    job: Job,
    out: Path,
    tell: Callable[[str], None],
) -> dict[str, Any]:
    path = out / "jobs" / f"{_key(config, job)}.json"
    if path.exists():
        return json.loads(path.read_text())
    row = run_job(bench, job, config)
    path.parent.mkdir(parents=True, exist_ok=True)
    waiting = path.with_suffix(".part")
    waiting.write_text(json.dumps(row))
    waiting.replace(path)
    tell(_line(bench, job, row))
    return row


def _line(bench: Bench, job: Job, row: dict[str, Any]) -> str:
    figures = ", ".join(f"{name} {row[name]:.3f}" for name in METRIC_UNITS)
    return f"{bench.name}: {job.method}, seed {job.seed}: {figures}"


def _table(
    config: CompareConfig, bench: Bench, rows: list[dict[str, Any]]
) -> ResultTable:
    table = ResultTable(f"{config.title}: {bench.name}", bench.mark)
    for method in dict.fromkeys(row["method"] for row in rows):
        mine = [row for row in rows if row["method"] == method]
        table.add(method, _mean(mine), **_spreads(mine), seconds=mine[0]["seconds"])
    plan = TrainingPlan()
    for name in BASELINES:
        started = time.process_time()
        found = score(train_on(bench.train, name, {}, plan), bench.test)
        table.add(name, found, seconds=time.process_time() - started)
    table.add("chance", chance_scores(bench.test))
    floor = jitter_floor(bench, config.jitter_m)
    if floor is not None:
        rows_of = np.linspace(0, len(bench.test) - 1, len(floor)).astype(int)
        truth = bench.test.responses[rows_of]
        rate = bench.test.frame.sample_rate
        found = compare_rows(truth, floor.responses, rate)
        table.add(f"truth, places off by {1e3 * config.jitter_m:g} mm", found)
    table.notes.append(
        f"{len(bench.train)} training rows, {len(bench.test)} rows of unseen "
        f"emitters; mean over seeds {', '.join(map(str, config.seeds))}"
    )
    return table


def _mean(rows: list[dict[str, Any]]) -> Scores:
    return {name: float(np.mean([row[name] for row in rows])) for name in METRIC_UNITS}


def _spreads(rows: list[dict[str, Any]]) -> dict[str, float]:
    spreads = {
        f"{name} spread": float(np.std([row[name] for row in rows]))
        for name in METRIC_UNITS
    }
    swaps = {
        f"swap {name}": float(np.mean([row["swap"][name] for row in rows]))
        for name in METRIC_UNITS
    }
    return spreads | swaps


def _plot(path: Path, table: ResultTable, rows: list[dict[str, Any]]) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 3.2), layout="constrained")
    figure.suptitle(f"{table.title} [{table.mark}]")
    panels = figure.subplots(1, 3)
    for axes, name in zip(panels, ("C50", "STFT", "Amp"), strict=True):
        for method in dict.fromkeys(row["method"] for row in rows):
            mine = [row for row in rows if row["method"] == method]
            seconds = [row["seconds"] for row in mine]
            axes.plot(seconds, [row[name] for row in mine], "o", label=method)
        axes.set_xlabel("CPU s of training")
        axes.set_ylabel(f"{name} {METRIC_UNITS[name]}")
    panels[-1].legend(fontsize="xx-small")
    figure.savefig(path, dpi=110)
