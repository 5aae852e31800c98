"""train-field compare: models x forms x seeds over data sets, resumable."""

import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fields.comparison.config import FORMS, CompareConfig, ModelConfig, SetConfig
from fields.comparison.pattern_check import check_pattern
from fields.comparison.sets import DividedSet, built_in, open_divided
from fields.comparison.table import comparison_table, plot_comparison
from fields.data import FieldData
from fields.evaluate import Scores, compare_rows, score, score_units
from fields.field import Field, report_of
from fields.plan import TrainingPlan
from fields.results import ResultTable
from fields.run import UNLIMITED_STEPS, train_on
from fields.table import model_config
from fields.watching import watcher
from rir.errors import ConfigError, UnknownNameError

__all__ = ["CompareConfig", "TrainingJob", "compare", "run_job"]

CHECKED_ROWS = 200
"""Rows the swap gap and the training error are taken at; means over 200 are steady to
about 7 % of the spread between rows, at a fraction of the cost of all."""


@dataclass(frozen=True)
class TrainingJob:
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

    Every job's scores are a file of their own, and a job that was interrupted has
    its checkpoint, so that a comparison goes on where it stopped.

    Raises
    ------
    ConfigError
        If a model, a form or a setting is unknown; before anything is trained.
    """
    _check(config)
    out.mkdir(parents=True, exist_ok=True)
    tables = []
    for number, one in enumerate(config.sets):
        divided = _divided_set(one, Path(config.cache))
        rows = [
            _job_row(config, divided, job, out, tell) for job in _jobs(config, number)
        ]
        table = comparison_table(config, divided, rows)
        folder = out / divided.name
        folder.mkdir(exist_ok=True)
        table.save(folder)
        plot_comparison(folder / "seconds.png", table, rows)
        tables.append(table)
    return tables


def _check(config: CompareConfig) -> None:
    mistakes = []
    for number, one in enumerate(config.models):
        mistakes += [
            f"models.{number}.forms: no form {form!r}; known: {', '.join(FORMS)}"
            for form in one.forms
            if form not in FORMS
        ]
        try:
            model_config(one.model, one.config, one.preset)
        except (ConfigError, UnknownNameError) as error:
            mistakes.append(f"models.{number}: {error}")
    if mistakes:
        raise ConfigError("\n".join(mistakes))


def run_job(
    divided: DividedSet,
    job: TrainingJob,
    config: CompareConfig,
    folder: Path | None = None,
) -> dict[str, Any]:
    """Train and score one field; returns the row.

    Parameters
    ----------
    divided : DividedSet
        Data.
    job : TrainingJob
        What to train.
    config : CompareConfig
        The comparison it belongs to.
    folder : Path, optional
        For checkpoints; an interrupted job goes on from there.
    """
    field = train_on(
        divided.train,
        job.model.model,
        job.model.config,
        _plan(divided, job, config, folder),
        job.model.preset,
    )
    report = report_of(field)
    return {
        "method": job.method,
        "seed": job.seed,
        **score(field, divided.test),
        "swap": _swap_gap(field, divided.test),
        "swap seen": _swap_gap(field, divided.train),
        "pattern": check_pattern(field, divided.test),
        "train": score(field, divided.train.rows(_spread(divided.train))),
        "report": report,
        "seconds": report.get("seconds", job.budget_s),
    }


def _plan(
    divided: DividedSet, job: TrainingJob, config: CompareConfig, folder: Path | None
) -> TrainingPlan:
    form = FORMS[job.form]
    plan = TrainingPlan(
        steps=UNLIMITED_STEPS,
        budget_s=job.budget_s,
        batch_size=job.model.batch_size or config.batch_size,
        learning_rate=job.model.learning_rate or config.learning_rate,
        weight_decay=config.weight_decay,
        exchange=form.get("exchange", "none"),
        self_supervised=form.get("self_supervised", "none"),
        seed=job.seed,
        out=folder,
        resume=folder is not None,
        watch=watcher(divided.test),
    )
    if config.epochs is None:
        return plan
    return replace(plan, epochs=config.epochs, budget_s=None)


def _swap_gap(field: Field, data: FieldData) -> Scores:
    some = data.rows(_spread(data))
    scale = np.float32(some.frame.scale)
    one_way = field.predict(some.emitters, some.listeners) / scale
    other = field.predict(some.listeners, some.emitters) / scale
    return compare_rows(one_way, other, some.frame.sample_rate)


def _spread(data: Any) -> np.ndarray:
    return np.linspace(0, len(data) - 1, min(len(data), CHECKED_ROWS)).astype(int)


def _divided_set(one: SetConfig, cache: Path) -> DividedSet:
    if one.path:
        path = Path(one.path)
    else:
        path = built_in(one.scene, one.gains, one.listeners, cache, fewer=one.fewer)
    return open_divided(
        path,
        one.title,
        train_emitters=one.train_emitters,
        most_test_rows=one.test_rows,
        scene=one.scene,
        spread_emitters=one.spread_emitters,
    )


def _jobs(config: CompareConfig, number: int) -> Iterator[TrainingJob]:
    for seed in config.seeds:
        for model in config.models:
            for form in model.forms:
                budget = model.budget_s or config.budget_s
                yield TrainingJob(number, model, form, seed, budget)


def _key(config: CompareConfig, job: TrainingJob) -> str:
    from hashlib import sha256

    told = {
        "set": config.sets[job.set_number].model_dump(exclude_none=True),
        "model": job.model.model_dump(exclude={"forms"}),
        "form": job.form,
        "budget": job.budget_s,
        "epochs": config.epochs,
        "training": [config.batch_size, config.learning_rate, config.weight_decay],
    }
    digest = sha256(json.dumps(told, sort_keys=True, default=list).encode())
    return f"{job.model.model}-{job.form}-{job.seed}-{digest.hexdigest()[:12]}"


def _job_row(
    config: CompareConfig,
    divided: DividedSet,
    job: TrainingJob,
    out: Path,
    tell: Callable[[str], None],
) -> dict[str, Any]:
    path = out / "jobs" / f"{_key(config, job)}.json"
    if path.exists():
        return json.loads(path.read_text())
    path.parent.mkdir(parents=True, exist_ok=True)
    checkpoints = path.with_suffix("")
    row = run_job(divided, job, config, checkpoints)
    waiting = path.with_suffix(".part")
    waiting.write_text(json.dumps(row))
    waiting.replace(path)
    shutil.rmtree(checkpoints, ignore_errors=True)
    figures = ", ".join(f"{name} {row[name]:.3f}" for name in score_units())
    tell(f"{divided.name}: {job.method}, seed {job.seed}: {figures}")
    return row
