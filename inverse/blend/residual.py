"""When a network is asked, and whether it is heard."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fields.data import FieldData
from fields.plan import TrainingPlan
from inverse.acoustics import Acoustics
from inverse.blend.aligned import AlignedRows
from inverse.blend.fallback import NearestRows
from inverse.blend.guard import beaten_by_nearest
from inverse.blend.network import Joined, train_network
from inverse.blend.proof import prove
from inverse.rows.fitset import FitSet
from rir.errors import MissingPartError

__all__ = ["needs_network", "with_network"]

FloatArray = NDArray[np.float64]
POOR = 0.85
ENOUGH = 0.3
LEAST_ROWS = 32


def needs_network(acoustics: Acoustics, rows: int) -> bool:
    """Return whether a network may know what nothing else explains.

    Not where walls are sure and paths tell more than a little; and not where what
    answers has less than three tenths of the errors of interpolated rows at places
    left out: networks, which interpolate as well, do not come so far.
    """
    if rows < LEAST_ROWS:
        return False
    rest = acoustics.rest
    if rest is None:
        kept = acoustics.rows
        silent = kept is not None and not kept.responses.any()
        return acoustics.fitted is None and not silent
    walls = acoustics.report()["walls"]
    if walls and acoustics.unexplained <= POOR:
        return False
    scores = rest.proof.scores
    return "rows" not in scores or rest.proof.ratio("path", "rows") > ENOUGH


def with_network(
    acoustics: Acoustics,
    data: FieldData,
    plan: TrainingPlan,
    steps: int,
    *,
    alike: bool,
) -> tuple[Joined | None, list[str]]:
    """Train a network and join it where it proves right at places left out.

    Returns
    -------
    joined : Joined or None
        None where the rest is better without.
    words : list of str
        What was found, for the alarms.
    """
    try:
        network, hidden, said = train_network(data, plan, steps, alike=alike)
    except MissingPartError:
        return None, ["no network was asked: torch is not installed"]
    rows = FitSet.of(data)
    unheard = rows.rows(np.flatnonzero(hidden))
    told = _told(acoustics, rows, unheard)
    joined = Joined.fit(network, unheard.responses, told, said)
    both = joined.joined(told, said)
    nearest = NearestRows.of(rows).left_out(unheard)
    answers = {"rest": told, "both": both, "network": said, "nearest": nearest}
    proof = prove(unheard, answers)
    scores = f"{proof.ratio('both', 'rest'):.2f} of its errors at places left out"
    if proof.best in ("rest", "nearest") or beaten_by_nearest(proof, proof.best):
        return None, ["a trained network knows no more of this room"]
    if proof.best == "both":
        return joined, [f"a trained network is joined to the rest: {scores}"]
    return replace(joined, alone=True), ["a trained network answers alone"]


def _told(acoustics: Acoustics, rows: FitSet, unheard: FitSet) -> FloatArray:
    """Return what is said of rows without having heard their emitter."""
    kept: Any = acoustics.fitted
    if acoustics.rows is not None:
        return acoustics.rows.left_out(unheard)
    if kept is None or acoustics.rest is None:
        return AlignedRows.of(rows).left_out(unheard)
    early = kept.predict(unheard.emitters, unheard.listeners, rows.n_samples)
    return acoustics.rest.left_out(early, unheard)
