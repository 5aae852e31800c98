"""What train-field does: split, train, score beside baselines, write the run."""

import re
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from fields.convergence import AT_REST, late_fall
from fields.data import FieldData, prepare
from fields.evaluate import chance_scores, score
from fields.field import Alarmed, Field, report_of
from fields.plan import Progress, TrainingPlan, form_of
from fields.progress import progress_bar
from fields.results import ResultTable
from fields.run import UNLIMITED_STEPS, train_on
from fields.split import Split, split_by_emitter
from fields.table import FIELDS, model_config
from fields.watching import curve_writer, tell_all, tensorboard_writer, watcher
from rir import Dataset
from rir.command import make_console
from rir.config import dump_yaml
from rir.errors import ConfigError, TrainingError
from rir.schema import Schema

__all__ = ["RUN", "Request", "parse_seconds", "train_and_report"]

RUN = Schema("training run", 1)

BASELINES = ("nearest", "linear")
MAP_PLACES = 300
"""Listeners of the map drawn after a run: enough to see lobes and
shadows; `train-field map` draws finer."""
UNITS = {"": 1.0, "s": 1.0, "m": 60.0, "min": 60.0, "h": 3600.0}


@dataclass(frozen=True)
class Request:
    """Hold what was asked on the command line."""

    dataset: list[str]
    model: str
    exchange: bool
    self_supervised: bool
    budget: str
    steps: int | None
    seed: int
    out: Path | None
    resume: bool
    split: Path | None
    test_fraction: float
    sample_rate: float | None
    duration: float | None
    device: str
    settings: list[str]
    preset: str
    quiet: bool
    precision: str = "float32"
    tensorboard: bool = False

    def folder(self) -> Path:
        """Return the run folder."""
        if self.out is not None:
            return self.out
        name = Path(self.dataset[0]).resolve()
        stem = name.stem if name.suffix else name.name
        form = "-exchange" if self.exchange else ""
        form += "-ssl" if self.self_supervised else ""
        return Path("runs") / f"{stem}-{self.model}{form}-seed{self.seed}"


def train_and_report(request: Request) -> ResultTable:
    """Train one field, score it and its baselines, and write the run folder.

    Raises
    ------
    ConfigError
        If a setting or the budget cannot be understood.
    TrainingError
        If the run folder already holds a run and ``--resume`` was not given.
    """
    console = make_console()
    kind = FIELDS[request.model]
    module = kind.load_module()
    config = model_config(request.model, _settings(request.settings), request.preset)
    plan = _plan(request)
    dataset = Dataset.open(*request.dataset)
    folder = request.folder()
    split = _split(request, dataset, folder)
    data = prepare(
        dataset,
        sample_rate=request.sample_rate,
        duration=request.duration,
        train_rows=np.array(split.train, dtype=int),
        seed=request.seed,
        store=folder,
    )
    _write_config(folder, request, config, plan, data)
    console.out(dataset.mark, style="bold", end=" ")
    console.out(f"data: {split.describe()}")
    started = time.process_time()
    with progress_bar(console, request.model, quiet=request.quiet) as bar:
        tell = _listeners(request, folder, dataset.mark, bar)
        watch = watcher(data.rows(np.array(split.test)))
        plan = replace(plan, on_progress=tell, watch=watch)
        field = module.fit(data.rows(np.array(split.train)), config, plan)
    seconds = time.process_time() - started
    saved = field.save(folder / "field")
    table = _table(request, dataset.mark, field, data, split, plan, seconds)
    table.save(folder)
    _draw(folder, table, field, data, split)
    console.print(table.rich())
    lines = _summary(request, table, saved, folder, seconds)
    for line in lines + _doubts(field) + _unrest(field):
        console.out(line)
    return table


def parse_seconds(text: str) -> float:
    """Return seconds from text such as 60s, 2m or 1h.

    Raises
    ------
    ConfigError
        If it is not a positive time.

    Examples
    --------
    >>> parse_seconds("90s"), parse_seconds("2m")
    (90.0, 120.0)
    """
    found = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*([a-z]*)\s*", text.lower())
    if not found or found[2] not in UNITS or float(found[1]) <= 0:
        raise ConfigError(f"budget {text!r} is not a time; write 60s, 2m or 1h")
    return float(found[1]) * UNITS[found[2]]


def _settings(pairs: list[str]) -> dict[str, Any]:
    settings = {}
    for pair in pairs:
        name, sign, value = pair.partition("=")
        if not sign:
            raise ConfigError(f"--set {pair}: write name=value")
        settings[name.strip()] = yaml.safe_load(value)
    return settings


def _plan(request: Request) -> TrainingPlan:
    return TrainingPlan(
        steps=UNLIMITED_STEPS if request.steps is None else request.steps,
        budget_s=parse_seconds(request.budget),
        exchange=form_of(request.exchange, "double"),
        self_supervised=form_of(request.self_supervised, "pattern"),
        seed=request.seed,
        device=request.device,
        precision=request.precision,
        out=request.folder(),
        resume=request.resume,
    )


def _listeners(
    request: Request, folder: Path, mark: str, bar: Callable[[Progress], None]
) -> Callable[[Progress], None]:
    listeners = [bar, curve_writer(folder, request.model, mark)]
    if request.tensorboard:
        listeners.append(tensorboard_writer(folder))
    return tell_all(*listeners)


def _split(request: Request, dataset: Dataset, folder: Path) -> Split:
    path = folder / "split.json"
    if path.exists() and not request.resume:
        raise TrainingError(
            f"{folder} already holds a run; continue it with --resume, or name "
            "another folder with --out"
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise TrainingError(f"{folder} cannot be a run folder: {error}") from error
    if request.split is not None:
        split = Split.load(request.split, dataset)
    elif path.exists():
        split = Split.load(path, dataset)
    else:
        split = split_by_emitter(
            dataset, test_fraction=request.test_fraction, seed=request.seed
        )
    if not split.train or not split.test:
        raise TrainingError(
            f"{len(dataset)} responses leave {len(split.train)} to train on and "
            f"{len(split.test)} to test on; a run needs at least one of each"
        )
    split.save(path)
    return split


def _write_config(
    folder: Path, request: Request, config: Any, plan: TrainingPlan, data: FieldData
) -> None:
    plain = {
        name: value
        for name, value in asdict(plan).items()
        if name not in ("out", "watch", "on_progress", "resume")
    }
    content = {
        **RUN.stamp,
        "dataset": [str(path) for path in request.dataset],
        "mark": data.frame.mark,
        "model": request.model,
        "config": _listed(asdict(config)),
        "training": plain,
        "sample_rate": data.frame.sample_rate,
        "n_samples": data.frame.n_samples,
    }
    (folder / "config.yaml").write_text(dump_yaml(content))


def _listed(plain: dict[str, Any]) -> dict[str, Any]:
    return {
        name: list(value) if isinstance(value, tuple) else value
        for name, value in plain.items()
    }


def _table(
    request: Request,
    mark: str,
    field: Field,
    data: FieldData,
    split: Split,
    plan: TrainingPlan,
    seconds: float,
) -> ResultTable:
    train, test = (data.rows(np.array(rows)) for rows in (split.train, split.test))
    table = ResultTable(f"{request.model} on unseen emitters", mark)
    table.add(request.model, score(field, test), seconds=seconds)
    plan = replace(plan, self_supervised="none")
    for name in BASELINES:
        if name == request.model:
            continue
        before = time.process_time()
        baseline = train_on(train, name, {}, plan)
        table.add(name, score(baseline, test), seconds=time.process_time() - before)
    table.add("chance", chance_scores(test, seed=request.seed))
    frame = data.frame
    table.notes += [
        f"paper's metrics at {frame.sample_rate:g} Hz over "
        f"{1e3 * frame.n_samples / frame.sample_rate:g} ms, "
        f"{len(test)} test rows; responses divided by {frame.scale:.4g}",
        "chance: the true response of another test row, drawn at random",
    ]
    return table


def _draw(
    folder: Path, table: ResultTable, field: Field, data: FieldData, split: Split
) -> None:
    from fields.maps import draw_more, make_map, plot_map
    from fields.plots import plot_results

    test = data.rows(np.array(split.test))
    plot_results(folder / "results.png", table, _history(field), field, test)
    emitter = test.emitters[0]
    span = data.frame.high - data.frame.low
    spacing = max(float(np.sqrt(span[0] * span[1] / MAP_PLACES)), 0.05)
    shown = make_map(field, emitter, spacing=spacing)
    plot_map(folder / "map.png", shown, f"{field.name}, an unseen emitter")
    shown.save(folder / "map.npz")
    draw_more(field, folder)


def _history(field: Field) -> list[list[float]]:
    return report_of(field).get("history", [])


def _doubts(field: Field) -> list[str]:
    """Return what a field that judges itself says of the room."""
    return [f"! {one}" for one in field.alarms] if isinstance(field, Alarmed) else []


def _unrest(field: Field) -> list[str]:
    fall = late_fall(_history(field))
    if not fall > AT_REST:
        return []
    return [
        f"not converged: the loss still fell by {100 * fall:.0f} % in the last "
        "quarter of the budget"
    ]


def _summary(
    request: Request,
    table: ResultTable,
    saved: Path,
    folder: Path,
    seconds: float,
) -> list[str]:
    ours = table.rows[0]
    nearest = next(row for row in table.rows if row["method"] == "nearest")
    chance = table.rows[-1]
    form = " with exchange" if request.exchange else ""
    return [
        f"{table.mark} data, model {request.model}{form}, {seconds:.1f} CPU s",
        f"C50 difference {ours['C50']:.2f} dB (nearest {nearest['C50']:.2f}, "
        f"chance {chance['C50']:.2f})",
        f"STFT difference {ours['STFT']:.2f} (nearest {nearest['STFT']:.2f}, "
        f"chance {chance['STFT']:.2f})",
        f"field: {saved}",
        f"table, plots, map, split, configuration: {folder}",
    ]
