"""How much is made of waveforms, chosen by the errors at places left out."""

from dataclasses import replace
from typing import Any

import numpy as np

from fields.path.fitset import FitSet
from fields.path.proof import prove
from fields.path.tint import tint_filter

__all__ = ["settled"]

CHOICES: tuple[dict[str, Any], ...] = (
    {"low": 0.2, "high": 0.6},
    {"low": 0.1, "high": 0.4, "steady": True},
)
CALM = 1.0, 0.93
JUDGED_ROWS = 60


def settled(rough: Any, rows: FitSet, early: np.ndarray, energies: np.ndarray) -> Any:
    """Return the completion whose errors are least.

    Parameters
    ----------
    rough : Completion
        Fitted, its levels not yet put right.
    rows : FitSet
        Measured rows.
    early : numpy.ndarray
        What paths say of them, shape (rows, n_samples).
    energies : numpy.ndarray
        Of the rows' tiles, shape (rows, bands, bins).
    """
    tried = {}
    for number, how in enumerate(CHOICES):
        agreement = replace(rough.agreement, **how)
        one = replace(rough, agreement=agreement)
        tried[str(number)] = one.trimmed(rows, early, energies)
    best = _best(tried, rows, early)
    tried = {
        str(calm): replace(best, agreement=replace(best.agreement, calm=calm))
        for calm in CALM
    }
    best = _best(tried, rows, early)
    told = best.apply(early, rows.emitters, rows.listeners)
    taps = tint_filter(rows.responses, told, rows.sample_rate)
    return _best({"as it is": best, "": replace(best, finish=taps)}, rows, early)


def _best(tried: dict[str, Any], rows: FitSet, early: np.ndarray) -> Any:
    if len(tried) < 2:
        return next(iter(tried.values()))
    some = np.linspace(0, len(rows) - 1, min(len(rows), JUDGED_ROWS)).astype(int)
    judged, said = rows.rows(some), early[some]
    ends = judged.emitters, judged.listeners
    answers = {name: one.apply(said, *ends) for name, one in tried.items()}
    return tried[prove(judged, answers).best]
