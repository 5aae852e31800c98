"""Variants of a completion, chosen by their errors at places left out."""

from dataclasses import replace
from typing import Any

import numpy as np

from analysis.scores import Scores
from inverse.late.spectral_tilt import tilt_filter
from inverse.rows.fitset import FitSet
from inverse.rows.proof import likeness, prove

__all__ = ["choose_variant"]

CHOICES: tuple[dict[str, Any], ...] = (
    {"low": 0.2, "high": 0.6},
    {"low": 0.1, "high": 0.4, "steady": True},
)
LATE_GAINS = 1.0, 0.93
"""Of late waveforms: what is left of chance in them is better 0.6 dB too quiet."""
JUDGED_ROWS = 48  # enough to rank variants; each answers them some twenty times (0066)
DECAYS = "T60", "C50", "EDT"
LEAN = 0.1
"""Errors of decays differ more by chance of few rows than those of waveforms."""


def choose_variant(
    rough: Any,
    rows: FitSet,
    early: np.ndarray,
    energies: np.ndarray,
    guide: np.ndarray | None = None,
) -> Any:
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
    guide : numpy.ndarray, optional
        The answer whose energies are believed; the paths' when left out.
    """
    said = early, guide
    tried = {}
    for number, how in enumerate(CHOICES if guide is None else CHOICES[:1]):
        agreement = replace(rough.agreement, **how)
        one = replace(rough, agreement=agreement)
        tried[str(number)] = one.trimmed(rows, early, energies, guide)
    best = _best(tried, rows, *said)
    tried = {}
    for gain in LATE_GAINS:
        one = replace(best, agreement=replace(best.agreement, late_gain=gain))
        told = one.apply(early, rows.emitters, rows.listeners, guide)
        taps = tilt_filter(rows.responses, told, rows.sample_rate)
        tried |= {f"{gain}": one, f"{gain} finished": replace(one, finish=taps)}
    return _best(tried, rows, *said, lean=LEAN)


def _best(
    tried: dict[str, Any],
    rows: FitSet,
    early: np.ndarray,
    guide: np.ndarray | None,
    lean: float = 1.0,
) -> Any:
    """Return what has the smallest errors, those of decays counted `lean` times."""
    if len(tried) < 2:
        return next(iter(tried.values()))
    some = np.linspace(0, len(rows) - 1, min(len(rows), JUDGED_ROWS)).astype(int)
    judged, said = rows.rows(some), early[some]
    loud = None if guide is None else guide[some]
    ends = judged.emitters, judged.listeners
    answers = {name: one.apply(said, *ends, loud) for name, one in tried.items()}
    scores = prove(judged, answers).scores
    first = next(iter(scores.values()))
    ratios = {name: _ratio(one, first, lean) for name, one in scores.items()}
    return tried[min(ratios, key=lambda name: ratios[name])]


def _ratio(scores: Scores, others: Scores, lean: float) -> float:
    """Return the weighted sum of logarithms of ratios of errors."""
    total = 0.0
    for kind, weight in ((True, lean), (False, 1.0)):
        part = {name: one for name, one in scores.items() if (name in DECAYS) == kind}
        total += weight * len(part) * np.log(likeness(part, others))
    return total
