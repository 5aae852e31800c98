"""Divide one take, block of channels by block, and let the checks look at it."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.checks import CHECKS
from capture.checks.evidence import Evidence
from capture.checks.finding import Limits, Verdict
from capture.signal.arrangement import as_float
from capture.signal.crests import Crests
from capture.signal.division import Divider, divide
from capture.signal.energy import EnergyMap, Octaves
from capture.signal.reference import Reference
from capture.signal.residual import Residual
from capture.signal.stretch import apply_stretch

__all__ = ["Examined", "divide_only", "examine", "gather_evidence"]

Array = NDArray[np.float64]

DRIFT_TO_CORRECT = 2e-8


@dataclass(frozen=True, eq=False)
class Examined:
    """A divided take with all findings."""

    response: Array
    reference: Reference
    verdicts: tuple[Verdict, ...]
    figures: dict[str, Any]


def examine(
    take: NDArray[Any],
    reference: Reference,
    golden: Reference | None,
    direct_delay: Array | None,
    limits: Limits,
) -> Examined:
    """Deconvolve and check one take.

    Parameters
    ----------
    take : ndarray, shape (channels, n)
        The recording, of any real type.
    reference : Reference
        What to divide by.
    golden : Reference or None
        The session's first good loopback.
    direct_delay : ndarray or None
        Expected direct sound per channel, s.
    limits : Limits
        What is tolerated.
    """
    evidence = gather_evidence(take, reference, golden, direct_delay, limits)
    latency = reference.clock.latency
    known = bool(np.isfinite(latency))
    evidence.figures["latency_samples"] = float(latency) if known else None
    verdicts = [verdict for check in CHECKS.values() for verdict in check(evidence)]
    response = evidence.response
    response[~evidence.finite] = np.nan
    return Examined(response, reference, tuple(verdicts), evidence.figures)


def divide_only(take: NDArray[Any], reference: Reference) -> Examined:
    """Deconvolve one take and look at nothing.

    Parameters
    ----------
    take : ndarray, shape (channels, n)
        The recording, of any real type.
    reference : Reference
        What to divide by.
    """
    response = divide(as_float(take), reference)
    _restore_clock(response, reference)
    return Examined(response, reference, (), {})


def gather_evidence(
    take: NDArray[Any],
    reference: Reference,
    golden: Reference | None,
    direct_delay: Array | None,
    limits: Limits,
) -> Evidence:
    """Deconvolve one take and gather what checks look at; see :func:`examine`."""
    excitation = reference.excitation
    channels, n = take.shape
    recording = as_float(take)
    finite = np.isfinite(recording.sum(axis=1))
    if not finite.all():
        recording = np.where(finite[:, np.newaxis], recording, 0.0)
    response = np.empty((channels, excitation.pre + excitation.length))
    octaves = Octaves(excitation)
    parts = Divider(reference, octaves, recording, response).parts()
    crests = [part.crests for part in parts if part.crests is not None]
    _restore_clock(response, reference)
    latency = reference.clock.latency
    return Evidence(
        recording=recording,
        finite=finite,
        response=response,
        reference=reference,
        energies=EnergyMap(
            octaves,
            np.concatenate([part.energy for part in parts]),
            float(latency) if np.isfinite(latency) else 0.0,
            n,
        ),
        residual=Residual.joined([part.residual for part in parts]),
        groups=[group for part in parts for group in part.groups],
        crests=Crests.joined(crests) if crests else None,
        golden=golden,
        direct_delay=direct_delay,
        limits=limits,
    )


def _restore_clock(response: Array, reference: Reference) -> None:
    """Put responses on the player's clock: the recorder's may have run off."""
    clock, pre = reference.clock, reference.excitation.pre
    if not clock.runs_off or not np.isfinite(clock.latency):
        return
    factor = 1 / (1 + clock.drift)
    for row in response:
        row[:] = factor * apply_stretch(row, factor - 1, pre * (1 - factor))
