"""Score fields on rows they have not seen, beside chance."""

from collections.abc import Sequence

import numpy as np

from fields.data import FieldData
from fields.field import Field

__all__ = ["METRIC_UNITS", "Scores", "chance_scores", "compare_rows", "score"]

METRIC_UNITS = {
    "Amp": "",
    "Env": "%",
    "T60": "%",
    "C50": "dB",
    "EDT": "ms",
    "STFT": "",
    "STFT*": "",
}
"""The metrics of the paper's tables, with the units they are printed in; STFT*
has the truth as its norm, where the paper's code has the prediction."""
PRINTED_FACTOR = {"Env": 100.0, "T60": 100.0, "EDT": 1000.0}

Scores = dict[str, float]
SCORED_ROWS = 256


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
        Values in :data:`METRIC_UNITS`; NaN where no row has a value.
    """
    scale = np.float32(data.frame.scale)
    parts = [
        _differences(
            data.responses[rows],
            field.predict(data.emitters[rows], data.listeners[rows]) / scale,
            data.frame.sample_rate,
            flavour,
        )
        for rows in _blocks(len(data))
    ]
    return _means(parts)


def chance_scores(data: FieldData, *, seed: int = 0, flavour: str = "paper") -> Scores:
    """Score the truth of other rows drawn at random: knowing the room, not the place.

    A field that does not beat this has learned nothing about positions.
    """
    order = np.random.default_rng(seed).permutation(len(data))
    # A shuffled row must not meet itself.
    partner = np.roll(order, 1)
    rate = data.frame.sample_rate
    parts = [
        _differences(
            data.responses[order[rows]], data.responses[partner[rows]], rate, flavour
        )
        for rows in _blocks(len(data))
    ]
    return _means(parts)


def compare_rows(
    truth: np.ndarray, prediction: np.ndarray, sample_rate: float
) -> Scores:
    """Return the mean difference of two sets of responses, shape (rows, n)."""
    return _means([_differences(truth, prediction, sample_rate, "paper")])


def _blocks(count: int) -> list[np.ndarray]:
    return [
        np.arange(start, min(start + SCORED_ROWS, count))
        for start in range(0, count, SCORED_ROWS)
    ]


def _differences(
    truth: np.ndarray, prediction: np.ndarray, sample_rate: float, flavour: str
) -> dict[str, np.ndarray]:
    from analysis import METRICS, paper_metrics

    first = np.asarray(truth, dtype=np.float64)
    second = np.asarray(prediction, dtype=np.float64)
    found = dict(paper_metrics(first, second, sample_rate, flavour=flavour))
    rate = round(sample_rate)
    found["STFT*"] = METRICS["STFT"].difference(second, first, rate, flavour)
    return {
        name: np.atleast_1d(found[name]) * PRINTED_FACTOR.get(name, 1.0)
        for name in METRIC_UNITS
    }


def _means(parts: Sequence[dict[str, np.ndarray]]) -> Scores:
    if not parts:
        return dict.fromkeys(METRIC_UNITS, float("nan"))
    return {
        name: _nan_mean(np.concatenate([part[name] for part in parts]))
        for name in METRIC_UNITS
    }


def _nan_mean(values: np.ndarray) -> float:
    held = values[np.isfinite(values)]
    return float(held.mean()) if len(held) else float("nan")
