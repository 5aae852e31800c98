"""Train one field from a data set: the library's front door."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fields.data import FieldData, check_dataset, prepare
from fields.field import Field
from fields.plan import Progress, TrainingPlan, form_of
from fields.table import FIELDS, model_config
from rir import Dataset
from rir.errors import DatasetError, TrainingError

__all__ = ["train", "train_on"]

STEPS = 2000
"""Of a training with neither steps nor budget: as in TrainingPlan."""
UNLIMITED_STEPS = 10_000_000
"""More than any budget of CPU seconds lets a training do."""


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
        If ``config`` names something the model does not have, or a value is no
        sensible one.
    DatasetError
        If ``dataset`` is none, or ``rows`` are not rows of it.

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
        exchange=form_of(exchange, "double"),
        self_supervised=form_of(self_supervised, "pattern"),
        seed=seed,
        device=device,
        out=out,
        resume=resume,
        on_progress=on_progress,
    )
    check_dataset(dataset)
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
    if index.dtype == bool and index.shape == (count,):
        index = np.flatnonzero(index)
    if index.ndim != 1 or (index.size and index.dtype.kind not in "iu"):
        raise DatasetError(
            f"rows are numbers of responses, 0 to {count - 1}, or a mask of "
            f"{count}; not {index.dtype} of shape {index.shape}"
        )
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
