"""Divide one take, block of channels by block, and let the checks look at it."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.checks import CHECKS
from capture.checks.evidence import Evidence
from capture.checks.finding import Finding, TakeLimits
from capture.signal.arrangement import as_float
from capture.signal.crests import Crests
from capture.signal.division import Divider, divide
from capture.signal.energy import EnergyMap, Octaves
from capture.signal.reference import SweepReference
from capture.signal.residual import Residual
from capture.signal.stretch import apply_stretch

__all__ = ["CheckedTake", "check_take", "divide_only", "gather_evidence"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CheckedTake:
    """A divided take with all findings."""

    response: Array
    reference: SweepReference
    findings: tuple[Finding, ...]
    figures: dict[str, Any]


def check_take(
    take: NDArray[Any],
    reference: SweepReference,
    golden: SweepReference | None,
    direct_delay: Array | None,
    limits: TakeLimits,
) -> CheckedTake:
    """Deconvolve and check one take.

    Parameters
    ----------
    take : ndarray, shape (channels, n)
        The recording, of any real type.
    reference : SweepReference
        What to divide by.
    golden : SweepReference or None
        The session's first good loopback.
    direct_delay : ndarray or None
        Expected direct sound per channel, s.
    limits : TakeLimits
        What is tolerated.
    """
    evidence = gather_evidence(take, reference, golden, direct_delay, limits)
    latency = reference.clock.latency
    known = bool(np.isfinite(latency))
    evidence.figures["latency_samples"] = float(latency) if known else None
    findings = [finding for check in CHECKS.values() for finding in check(evidence)]
    response = evidence.response
    response[~evidence.finite] = np.nan
    return CheckedTake(response, reference, tuple(findings), evidence.figures)


def divide_only(take: NDArray[Any], reference: SweepReference) -> CheckedTake:
    """Deconvolve one take and look at nothing.

    Parameters
    ----------
    take : ndarray, shape (channels, n)
        The recording, of any real type.
    reference : SweepReference
        What to divide by.
    """
    response = divide(as_float(take), reference)
    _restore_clock(response, reference)
    return CheckedTake(response, reference, (), {})


def gather_evidence(
    take: NDArray[Any],
    reference: SweepReference,
    golden: SweepReference | None,
    direct_delay: Array | None,
    limits: TakeLimits,
) -> Evidence:
    """Deconvolve one take and gather what checks look at; see `check_take`."""
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


def _restore_clock(response: Array, reference: SweepReference) -> None:
    """Put responses on the player's clock: the recorder's may have run off."""
    clock, pre = reference.clock, reference.excitation.pre
    if not clock.runs_off or not np.isfinite(clock.latency):
        return
    factor = 1 / (1 + clock.drift)
    for row in response:
        row[:] = factor * apply_stretch(row, factor - 1, pre * (1 - factor))
