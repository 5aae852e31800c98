"""What a room shows, in one or two sentences."""

import math

from analysis.report.contents import RoomSummary

__all__ = ["verdict"]


def verdict(summary: RoomSummary) -> str:
    """Return what a room shows.

    Ten is about the ratio the paper finds for equal omnidirectional devices.

    Parameters
    ----------
    summary : RoomSummary
    """
    head = f"{summary.room} ({summary.mark}): {_finding(summary)}."
    head += _typical(summary)
    odd = [p for p in summary.pairs if p.faults]
    if not odd or summary.unequal_patterns > 0.5:
        return head
    named = "; ".join(f"pair {p.pair}: {p.faults[0].words}" for p in odd[:3])
    more = f"; and {len(odd) - 3} more below" if len(odd) > 3 else ""
    return f"{head} What stands out: {named}{more}."


def _finding(summary: RoomSummary) -> str:
    ratio = summary.ratio
    if math.isnan(ratio):
        return "undetermined; no metric has both kinds of distance"
    if math.isinf(ratio):
        return "reciprocal; swapped responses are equal"
    said = f"swapped responses are {ratio:.3g} times closer than un-paired ones"
    if summary.unequal_patterns > 0.5:
        share = round(100 * summary.unequal_patterns)
        return (
            f"not reciprocal; {said}, and in {share} % of the pairs the difference "
            "is that of unequal gain patterns of loudspeaker and microphone"
        )
    odd = sum(bool(pair.faults) for pair in summary.pairs)
    sound = summary.ratio_without_outliers
    if 0 < odd <= summary.n_pairs / 2 and math.isfinite(sound):
        said = (
            f"apart from {odd} of {summary.n_pairs} pairs swapped responses are "
            f"{sound:.3g} times closer than un-paired ones ({ratio:.3g} with all pairs)"
        )
        ratio = sound
    return f"{_degree(ratio)}; {said}"


def _degree(ratio: float) -> str:
    if ratio >= 5:
        return "reciprocal"
    return "only partly reciprocal" if ratio >= 2 else "not reciprocal"


def _typical(summary: RoomSummary) -> str:
    """Say what all pairs share, where it is enough to matter."""
    if summary.unequal_patterns > 0.5:
        return ""
    typical = summary.typical
    said = []
    if typical.position_mm > 1.5:
        said.append(f"places were met again to about {typical.position_mm:.0f} mm")
    if abs(typical.gain_db) > 0.1:
        said.append(f"B to A is {typical.gain_db:+.2f} dB re A to B")
    if abs(typical.temperature_k) > 0.06:
        said.append(f"the air changed by {typical.temperature_k:+.2f} K")
    return f" In the median pair {' and '.join(said)}." if said else ""
