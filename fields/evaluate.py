"""Score fields on rows they have not seen, beside chance."""

import numpy as np

from analysis.scores import (
    METRIC_UNITS,
    Scores,
    compare_rows,
    mean_scores,
    row_scores,
    score_units,
)
from fields.data import FieldData
from fields.field import Field
from rir.errors import TrainingError

__all__ = [
    "METRIC_UNITS",
    "Scores",
    "chance_scores",
    "compare_rows",
    "score",
    "score_units",
]

SCORED_ROWS = 256
"""Rows scored in one go: bounds memory; the means do not depend on it."""


def score(field: Field, data: FieldData, *, flavour: str = "paper") -> Scores:
    """Return the mean difference over the rows, metric by metric.

    Both sides are divided by the frame's scale first, because the paper's
    metrics have absolute floors.

    Parameters
    ----------
    field : Field
        Any trained field.
    data : FieldData
        Held-out rows.
    flavour : str
        Definition of the metrics: paper, raf or robust.

    Returns
    -------
    dict
        Values in the units of :func:`score_units`; NaN where no row has a value.

    Raises
    ------
    TrainingError
        If the field answers what is no response: not finite, or of another shape.
    """
    scale = np.float32(data.frame.scale)
    parts = []
    for rows in _blocks(len(data)):
        truth = data.responses[rows]
        answer = field.predict(data.emitters[rows], data.listeners[rows]) / scale
        if answer.shape != truth.shape or not np.isfinite(answer).all():
            raise TrainingError(
                f"{field.name} answers an array of shape {answer.shape}, "
                f"{np.isfinite(answer).sum()} of its numbers finite; asked are finite "
                f"responses of shape {truth.shape}"
            )
        parts.append(row_scores(truth, answer, data.frame.sample_rate, flavour))
    return mean_scores(parts)


def chance_scores(data: FieldData, *, seed: int = 0, flavour: str = "paper") -> Scores:
    """Score the truth of other rows drawn at random: knowing the room, not the place.

    A field that does not beat this has learned nothing about positions.
    """
    order = np.random.default_rng(seed).permutation(len(data))
    # A shuffled row must not meet itself.
    partner = np.roll(order, 1)
    rate = data.frame.sample_rate
    parts = [
        row_scores(
            data.responses[order[rows]], data.responses[partner[rows]], rate, flavour
        )
        for rows in _blocks(len(data))
    ]
    return mean_scores(parts)


def _blocks(count: int) -> list[np.ndarray]:
    return [
        np.arange(start, min(start + SCORED_ROWS, count))
        for start in range(0, count, SCORED_ROWS)
    ]
