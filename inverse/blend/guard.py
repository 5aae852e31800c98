"""Whatever answers must be nearer than the nearest response, or that is answered."""

from dataclasses import replace

import numpy as np

from inverse.acoustics import Acoustics
from inverse.blend.fallback import NearestRows
from inverse.blend.proof import MOST_ROWS, Proof, likeness, prove
from inverse.rows.fitset import FitSet

__all__ = ["beaten_by_nearest", "guarded"]

DOUBTFUL = 0.2
"""Rooms whose paths leave less of the energy are not asked."""
LEAST_ROWS = 16
WORSE = 1.05
SURE = 0.9
CHIEF = ("C50", "STFT")


def beaten_by_nearest(proof: Proof, name: str, nearest: str = "nearest") -> bool:
    """Return whether an answer is worse than another, in all or in the chief metrics.

    Examples
    --------
    >>> proof = Proof({"a": {"C50": 2.0, "T60": 1.0}, "nearest": {"C50": 1, "T60": 9}})
    >>> beaten_by_nearest(proof, "a")
    True
    """
    return _beaten(proof, name, nearest) > WORSE


def _beaten(proof: Proof, name: str, other: str) -> float:
    """Return an answer's errors over another's, in all or in the chief metrics."""
    if name not in proof.scores or other not in proof.scores:
        return np.inf
    told, plain = proof.scores[name], proof.scores[other]
    chief = {one: told[one] for one in CHIEF if one in told}
    return max(likeness(told, plain), likeness(chief, plain))


def guarded(acoustics: Acoustics, rows: FitSet) -> Acoustics:
    """Return what was heard, or the nearest rows where they prove nearer.

    Parameters
    ----------
    acoustics : Acoustics
        What answers so far.
    rows : FitSet
        All measured rows.
    """
    fitted, rest = acoustics.fitted, acoustics.rest
    if fitted is None or rest is None or acoustics.unexplained < DOUBTFUL:
        return acoustics
    if len(rows) < LEAST_ROWS:
        return acoustics
    # rows laid on their direct sounds are seldom worse than the nearest of them
    if _beaten(rest.proof, "path", "rows") < SURE:
        return acoustics
    nearest = NearestRows.of(rows)
    judged = rows.spread(MOST_ROWS)
    early = fitted.predict(judged.emitters, judged.listeners, rows.n_samples)
    told = {"told": rest.left_out(early, judged), "nearest": nearest.left_out(judged)}
    if not beaten_by_nearest(prove(judged, told), "told"):
        return acoustics
    words = (
        "the nearest response is answered: at emitter places left out nothing else "
        "came nearer; record more pairs, and check poses and units"
    )
    return replace(
        acoustics,
        fitted=None,
        rows=nearest,
        rest=None,
        unexplained=1.0,
        alarms=[words, *(f"of what is not used: {one}" for one in acoustics.alarms)],
    )
