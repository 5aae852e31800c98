"""Errors of several predictions for rows of emitter places left out."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from analysis.scores import METRIC_UNITS, Scores, compare_rows
from inverse.rows.fitset import FitSet

__all__ = ["Proof", "beaten_by_nearest", "error_ratio", "likeness", "prove"]

MOST_ROWS = 100  # scored: means of metrics are then known to some per cent
LEAST = 1e-6  # of a metric: smaller errors are none, and their ratio says nothing
WORSE = 1.05  # errors 5 % larger are worse; less is chance in a hundred rows
CHIEF = ("C50", "STFT")
"""One metric of decays and one of waveforms: no answer may lose in both."""
EARLY_S = 0.15  # answers differ early; what follows is told by the same late field


@dataclass(frozen=True, eq=False)
class Proof:
    """Hold the scores of answers by name; the first is the preferred one."""

    scores: dict[str, Scores] = field(default_factory=dict)

    @property
    def best(self) -> str:
        """Name of the answer with the smallest errors on the whole."""
        names = list(self.scores)
        first = names[0]
        ratios = [likeness(self.scores[one], self.scores[first]) for one in names]
        return names[int(np.argmin(ratios))]

    def ratio(self, name: str, other: str) -> float:
        """Return how large one answer's errors are beside another's."""
        return likeness(self.scores[name], self.scores[other])


def likeness(scores: Scores, others: Scores) -> float:
    """Return the geometric mean over metrics of one answer's errors over another's.

    Examples
    --------
    >>> likeness({"C50": 1.0, "T60": 2.0}, {"C50": 2.0, "T60": 4.0})
    0.5
    """
    ratios = [
        np.log(max(value, LEAST) / max(others[name], LEAST))
        for name, value in scores.items()
        if np.isfinite(value) and np.isfinite(others[name])
    ]
    return float(np.exp(np.mean(ratios))) if ratios else 1.0


def prove(
    rows: FitSet,
    answers: Mapping[str, NDArray[np.float64]],
    known: Mapping[str, Scores] | None = None,
) -> Proof:
    """Score answers to rows, each of shape (rows, n), by the metrics of the tables.

    The first 0.15 s of at most a hundred rows are scored, drawn evenly; scores that
    are `known` are taken over.
    """
    count = min(len(rows), MOST_ROWS)
    some = np.linspace(0, len(rows) - 1, count).astype(int)
    early = slice(0, round(EARLY_S * rows.sample_rate))
    truth = rows.responses[some, early]
    known = known or {}
    return Proof(
        {
            name: known.get(name)
            # What else is installed decides nothing.
            or compare_rows(truth, answer[some, early], rows.sample_rate, METRIC_UNITS)
            for name, answer in answers.items()
        }
    )


def beaten_by_nearest(proof: Proof, name: str, nearest: str = "nearest") -> bool:
    """Return whether an answer is worse than another, in all or in the chief metrics.

    Examples
    --------
    >>> proof = Proof({"a": {"C50": 2.0, "T60": 1.0}, "nearest": {"C50": 1, "T60": 9}})
    >>> beaten_by_nearest(proof, "a")
    True
    """
    return error_ratio(proof, name, nearest) > WORSE


def error_ratio(proof: Proof, name: str, other: str) -> float:
    """Return an answer's errors over another's, in all or in the chief metrics."""
    if name not in proof.scores or other not in proof.scores:
        return np.inf
    own, others = proof.scores[name], proof.scores[other]
    chief = {metric: own[metric] for metric in CHIEF if metric in own}
    return max(likeness(own, others), likeness(chief, others))
