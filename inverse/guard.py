"""How far an answer is trusted beside simpler ones: nearest responses, networks."""

from dataclasses import replace

from inverse.acoustics import Acoustics
from inverse.blend.fallback import NearestRows
from inverse.rows.fitset import FitSet
from inverse.rows.proof import MOST_ROWS, beaten_by_nearest, error_ratio, prove
from inverse.rows.unexplained import BELIEVED, POOR
from inverse.rows.units import checked_units

__all__ = ["guarded", "needs_network"]

LEAST_ROWS = 16  # fewer rows left out cannot tell which answer is nearer
SURE = 0.9  # a tenth better than interpolated rows is better than the nearest as well
ENOUGH = 0.3
"""Of the errors of interpolated rows; networks, which interpolate, reach no less."""
LEAST_NETWORK_ROWS = 32  # one batch: with less a network learns nothing


def guarded(acoustics: Acoustics, rows: FitSet) -> Acoustics:
    """Return the room as found, or the nearest rows where they prove nearer.

    Parameters
    ----------
    acoustics : Acoustics
        What answers so far.
    rows : FitSet
        All measured rows.
    """
    fitted, blend = acoustics.fitted, acoustics.blend
    if fitted is None or blend is None or acoustics.unexplained < BELIEVED:
        return acoustics
    if len(rows) < LEAST_ROWS:
        return acoustics
    # rows laid on their direct sounds are seldom worse than the nearest of them
    if error_ratio(blend.proof, "path", "rows") < SURE:
        return acoustics
    nearest = NearestRows.of(rows)
    judged = rows.spread(MOST_ROWS)
    early = fitted.predict(judged.emitters, judged.listeners, rows.n_samples)
    own = blend.left_out(early, judged)
    proof = prove(judged, {"own": own, "nearest": nearest.left_out(judged)})
    if not beaten_by_nearest(proof, "own"):
        return acoustics
    words = (
        "the nearest response is answered: at emitter places left out nothing else "
        "came nearer; record more pairs, and check poses and units"
    )
    return replace(
        acoustics,
        fitted=None,
        rows=nearest,
        blend=None,
        unexplained=1.0,
        alarms=[words, *(f"of what is not used: {one}" for one in acoustics.alarms)],
    )


def needs_network(acoustics: Acoustics, rows: FitSet) -> bool:
    """Return whether a network may know what nothing else explains.

    Not where poses or the sample rate are in doubt; not where walls are sure and
    paths explain more than a little; and not where what answers has less than three
    tenths of the errors of interpolated rows at places left out: networks, which
    interpolate as well, do not come so far.
    """
    if len(rows) < LEAST_NETWORK_ROWS or checked_units(rows)[1]:
        return False
    blend = acoustics.blend
    if blend is None:
        kept = acoustics.rows
        silent = kept is not None and not kept.responses.any()
        return acoustics.fitted is None and not silent
    walls = acoustics.report()["walls"]
    if walls and acoustics.unexplained <= POOR:
        return False
    scores = blend.proof.scores
    return "rows" not in scores or blend.proof.ratio("path", "rows") > ENOUGH
