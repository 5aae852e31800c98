"""Several takes of the same places: one response without the bad ones."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.checks.finding import Finding

__all__ = ["Combination", "combine"]

Array = NDArray[np.float64]

MARGIN_DB = 6.0  # twice the usual distance: noise alone varies by less
HARMLESS_DB = -60.0  # a difference that no parameter of ISO 3382 shows
FEWEST_TO_JUDGE = 3  # of two takes nobody can tell which is the bad one


@dataclass(frozen=True, eq=False)
class Combination:
    """What came of several takes."""

    response: Array
    """Mean of the accepted takes. Shape (channels, n)."""
    accepted: tuple[bool, ...]
    """Which takes are in it."""
    any_clean: bool
    """Whether a take without hard faults was there."""
    distances_db: list[float]
    """Distance of each take from the sample-wise median, dB."""
    findings: list[Finding]
    """Which takes were left out."""


def combine(responses: Array, spoiled: list[bool]) -> Combination:
    """Average takes that are neither spoiled nor far from the others.

    Parameters
    ----------
    responses : ndarray, shape (takes, channels, n)
        One response per take.
    spoiled : list of bool
        Which takes have hard faults; they are used only if all have.

    Notes
    -----
    The distance is that from the sample-wise median response; a take further than
    6 dB beyond the median distance is left out. Of two takes nobody can tell which
    is the bad one: both stay.
    """
    clean = ~np.array(spoiled)
    any_clean = bool(np.any(clean))
    used = clean if any_clean else np.ones(len(responses), dtype=bool)
    distances = _distances(responses, used)
    accepted = used & np.isfinite(distances)
    if np.count_nonzero(accepted) >= FEWEST_TO_JUDGE:
        usual = float(np.median(distances[accepted]))
        accepted &= distances < max(usual + MARGIN_DB, HARMLESS_DB)
    if not np.any(accepted):
        accepted = np.ones(len(responses), dtype=bool)
    findings = [
        _left_out(int(number), float(distances[number]), bool(used[number]))
        for number in np.flatnonzero(~accepted)
    ]
    return Combination(
        responses[accepted].mean(axis=0),
        tuple(bool(value) for value in accepted),
        any_clean,
        [round(float(value), 1) for value in distances],
        findings,
    )


def _distances(responses: Array, used: NDArray[Any]) -> Array:
    middle = np.median(responses[used], axis=0)
    power = max(float(np.sum(middle**2)), 1e-300)
    off = np.sum((responses - middle) ** 2, axis=(1, 2))
    return 10 * np.log10(off / power + 1e-30)


def _left_out(number: int, distance: float, clean: bool) -> Finding:
    why = (
        f"it lies {distance:.1f} dB from the others" if clean else "it has hard faults"
    )
    return Finding(
        "outlier_take",
        True,
        f"take {number + 1} was left out: {why}",
        distance,
        MARGIN_DB,
        "dB",
    )
