"""Mean differences of responses over rows, in the units the paper's tables print."""

from collections.abc import Collection, Sequence

import numpy as np

__all__ = [
    "METRIC_UNITS",
    "Scores",
    "compare_rows",
    "mean_scores",
    "row_scores",
    "score_units",
]

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

Scores = dict[str, float]


def score_units(flavour: str = "paper") -> dict[str, str]:
    """Return the metrics that rows are scored by, with the units of their tables.

    Those of other installed packages follow the paper's, where they have the flavour.
    """
    from analysis.differences import compared_symbols
    from analysis.metrics import METRICS

    added = [name for name in compared_symbols(flavour) if name not in METRIC_UNITS]
    return METRIC_UNITS | {name: METRICS[name].table_unit for name in added}


def compare_rows(
    truth: np.ndarray,
    prediction: np.ndarray,
    sample_rate: float,
    names: Collection[str] | None = None,
) -> Scores:
    """Return the mean difference of two sets of responses, shape (rows, n)."""
    return mean_scores([row_scores(truth, prediction, sample_rate, "paper", names)])


def row_scores(
    truth: np.ndarray,
    prediction: np.ndarray,
    sample_rate: float,
    flavour: str,
    names: Collection[str] | None = None,
) -> dict[str, np.ndarray]:
    """Return the difference of each row by each metric, every array shape (rows,).

    The paper's metrics, and those that are named; all there are by default.
    """
    from analysis.differences import paper_metrics
    from analysis.metrics import METRICS

    first = np.asarray(truth, dtype=np.float64)
    second = np.asarray(prediction, dtype=np.float64)
    found = dict(paper_metrics(first, second, sample_rate, flavour=flavour))
    rate = round(sample_rate)
    found["STFT*"] = METRICS["STFT"].difference(second, first, rate, flavour)
    for name in score_units(flavour) if names is None else names:
        if name not in found:
            found[name] = METRICS[name].difference(first, second, rate, flavour)
    return {
        name: np.atleast_1d(values) * METRICS[name.removesuffix("*")].table_factor
        for name, values in found.items()
    }


def mean_scores(parts: Sequence[dict[str, np.ndarray]]) -> Scores:
    """Return the mean of each metric over the rows that have a value, else NaN."""
    if not parts:
        return dict.fromkeys(score_units(), float("nan"))
    return {
        name: _nan_mean(np.concatenate([part[name] for part in parts]))
        for name in parts[0]
    }


def _nan_mean(values: np.ndarray) -> float:
    held = values[np.isfinite(values)]
    return float(held.mean()) if len(held) else float("nan")
