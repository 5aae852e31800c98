"""Train one field from a data set: the library's front door."""

from collections.abc import Callable, Mapping
from dataclasses import fields as dataclass_fields
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np

from fields.data import FieldData, prepare
from fields.field import Field
from fields.plan import Progress, TrainingPlan
from fields.table import FIELDS
from rir import Dataset
from rir.errors import ConfigError, DatasetError, TrainingError

__all__ = ["exchange_form", "model_config", "train", "train_on"]

STEPS = 2000
SELF_SUPERVISED = ("none", "pattern", "teacher", "paper", "contrastive")
UNLIMITED_STEPS = 10_000_000
COUNTS = frozenset(
    [
        "bounce_points",
        "channels",
        "depth",
        "directions",
        "feature_width",
        "grid_features",
        "neighbours",
        "rays",
        "shells",
        "source_taps",
        "view_columns",
        "view_rows",
        "width",
    ]
)


def train(
    dataset: Dataset,
    model: str = "avr",
    exchange: bool | str = False,
    self_supervised: bool | str = False,
    budget_s: float | None = None,
    seed: int = 0,
    *,
    steps: int | None = None,
    rows: np.ndarray | None = None,
    config: Mapping[str, Any] | None = None,
    preset: str = "cpu",
    sample_rate: float | None = None,
    duration: float | None = None,
    device: str = "cpu",
    out: Path | None = None,
    resume: bool = False,
    on_progress: Callable[[Progress], None] | None = None,
) -> Field:
    """Train a field on a data set and answer it.

    Parameters
    ----------
    dataset : Dataset
        Responses and poses.
    model : str
        A name in ``FIELDS``.
    exchange : bool or str
        Emitter-listener exchange: True (or "double") learns each response in
        both directions, "flip" tosses a coin for each.
    self_supervised : bool or str
        Add the reciprocity loss on the field's own predictions; needs a model
        whose listener pattern can be exchanged.
    budget_s : float, optional
        Stop after so many CPU seconds (wall seconds on CUDA).
    seed : int
        Of weights, batches and coins.
    steps : int, optional
        Stop after so many steps; 2000 when no budget is given either.
    rows : numpy.ndarray, optional
        Rows to learn from; all by default.
    config : mapping, optional
        Values that replace the model's own, by name.
    preset : str
        Sizes to start from: "cpu", or "paper" for the paper's.
    sample_rate, duration : float, optional
        Resample (hertz) and crop (seconds) first; the data's own by default.
    device : str
        "cpu" or "cuda".
    out : Path, optional
        Folder for checkpoints and, when the set exceeds memory, its copy.
    resume : bool
        Continue from the checkpoint in ``out``.
    on_progress : callable, optional
        Called after each step.

    Returns
    -------
    Field
        ``field.predict(emitters, listeners)`` answers (queries, n) float32.

    Raises
    ------
    UnknownNameError
        If there is no such model.
    MissingPartError
        If the model needs torch and torch is not installed.
    ConfigError
        If ``config`` names something the model does not have.

    Examples
    --------
    >>> import numpy as np
    >>> from rir import Dataset
    >>> responses = np.zeros((2, 3, 8)); responses[..., 4] = 1.0
    >>> emitters = np.array([[0.0, 0, 1], [1.0, 0, 1]])
    >>> listeners = np.array([[0.0, 2, 1], [1.0, 2, 1], [2.0, 2, 1]])
    >>> dataset = Dataset.from_arrays(
    ...     responses, emitters, listeners, sample_rate=1000
    ... )
    >>> field = train(dataset, model="nearest")
    >>> field.predict(emitters[0], listeners).shape
    (3, 8)
    """
    limited = STEPS if budget_s is None else UNLIMITED_STEPS
    plan = TrainingPlan(
        steps=limited if steps is None else steps,
        budget_s=budget_s,
        exchange=exchange_form(exchange),
        self_supervised=_self_supervised_form(self_supervised),
        seed=seed,
        device=device,
        out=out,
        resume=resume,
        on_progress=on_progress,
    )
    if rows is not None:
        rows = _checked_rows(rows, len(dataset))
    data = prepare(
        dataset,
        sample_rate=sample_rate,
        duration=duration,
        train_rows=rows,
        seed=seed,
        store=out,
    )
    chosen = data if rows is None else data.rows(rows)
    return train_on(chosen, model, config, plan, preset)


def _checked_rows(rows: np.ndarray, count: int) -> np.ndarray:
    index = np.asarray(rows)
    if not len(index) or index.min() < 0 or index.max() >= count:
        raise DatasetError(
            f"rows name {len(index)} responses, and must name some of 0 to {count - 1}"
        )
    return index


def train_on(
    data: FieldData,
    model: str,
    config: Mapping[str, Any] | None,
    plan: TrainingPlan,
    preset: str = "cpu",
) -> Field:
    """Train a model on prepared rows."""
    if plan.self_supervised != "none" and not FIELDS[model].neural:
        raise TrainingError(
            f"{model} makes no predictions to learn from; choose avr or diffrir for "
            "self-supervision"
        )
    chosen = model_config(model, config or {}, preset)
    return FIELDS[model].load_module().fit(data, chosen, plan)


def model_config(model: str, values: Mapping[str, Any], preset: str = "cpu") -> Any:
    """Build a model's configuration from a preset and the values that differ.

    Raises
    ------
    ConfigError
        If the preset or a name is unknown, with the nearest one.
    """
    presets = FIELDS[model].load_module().PRESETS
    if preset not in presets:
        raise ConfigError(
            f"{model} has no preset {preset!r}; known: {', '.join(presets)}"
        )
    start = presets[preset]
    known = {one.name for one in dataclass_fields(start)}
    mistakes = [
        f"{name}: {model} has no such setting{_hint(name, known)}"
        for name in values
        if name not in known
    ]
    if mistakes:
        raise ConfigError("\n".join(mistakes))
    plain = {
        name: tuple(value) if isinstance(value, list) else value
        for name, value in values.items()
    }
    mistakes = [
        f"{name}: {problem}"
        for name, value in plain.items()
        if (problem := _unfit(name, value, getattr(start, name)))
    ]
    if mistakes:
        raise ConfigError("\n".join(mistakes))
    return replace(start, **plain)


def _unfit(name: str, value: Any, default: Any) -> str:
    """Say why a value cannot stand where ``default`` stands."""
    kinds = (int, float) if isinstance(default, float) else (type(default),)
    # True is an int to Python, but no number to a person.
    switched = isinstance(value, bool) and not isinstance(default, bool)
    if switched or not isinstance(value, kinds):
        return f"{value!r} is not {type(default).__name__}, as {default!r} is"
    if isinstance(value, int | float):
        least = 1 if name in COUNTS else 0
        if not value >= least:
            return f"{value!r} is below {least}"
    return ""


def _hint(name: str, known: set[str]) -> str:
    near = get_close_matches(name, known, n=1)
    return f" (did you mean {near[0]!r}?)" if near else f"; known: {sorted(known)}"


def exchange_form(exchange: bool | str) -> str:
    """Return none, flip or double.

    Raises
    ------
    ConfigError
        If the form is unknown.
    """
    if isinstance(exchange, bool):
        return "double" if exchange else "none"
    if exchange in ("none", "flip", "double"):
        return exchange
    raise ConfigError(f"no exchange {exchange!r}; known: none, flip, double")


def _self_supervised_form(form: bool | str) -> str:
    if isinstance(form, bool):
        return "pattern" if form else "none"
    if form in SELF_SUPERVISED:
        return form
    raise ConfigError(
        f"no self-supervised form {form!r}; known: {', '.join(SELF_SUPERVISED)}"
    )
