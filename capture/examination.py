"""Divide one take, block of channels by block, and let the checks look at it."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.arrangement import as_float
from capture.checks import CHECKS
from capture.energy import EnergyMap, Octaves
from capture.evidence import Evidence
from capture.excitation import Excitation
from capture.reference import Reference
from capture.residual import Residual, lag_gate, resynthesise
from capture.stretch import apply_stretch
from capture.verdict import Limits, Verdict

__all__ = ["Examined", "examine"]

Array = NDArray[np.float64]

CHANNELS_AT_ONCE = 4
CHANNELS_SINGLE = 8
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
    evidence = _divide(take, reference, golden, direct_delay, limits)
    latency = reference.clock.latency
    known = bool(np.isfinite(latency))
    evidence.figures["latency_samples"] = float(latency) if known else None
    verdicts = [verdict for check in CHECKS.values() for verdict in check(evidence)]
    response = evidence.response
    response[~evidence.finite] = np.nan
    return Examined(response, reference, tuple(verdicts), evidence.figures)


def _divide(
    take: NDArray[Any],
    reference: Reference,
    golden: Reference | None,
    direct_delay: Array | None,
    limits: Limits,
) -> Evidence:
    excitation = reference.excitation
    channels, n = take.shape
    recording = as_float(take)
    finite = np.isfinite(recording.sum(axis=1))
    if not finite.all():
        recording = np.where(finite[:, np.newaxis], recording, 0.0)
    response = np.empty((channels, excitation.pre + excitation.length))
    octaves = Octaves(excitation)
    gate = lag_gate(reference, n)
    energies, rests, groups = [], [], []
    for first in range(0, channels, CHANNELS_AT_ONCE):
        block = np.arange(first, min(first + CHANNELS_AT_ONCE, channels))
        rows = recording[block]
        rows = rows - rows.mean(axis=1, keepdims=True)
        spectra = excitation.transform(rows)
        spectra *= reference.reciprocal
        energies.append(octaves.measure(spectra))
        lags = excitation.inverse(spectra)
        _keep(lags, response[block[0] : block[-1] + 1], excitation)
        mixed, heard, names = _group(lags, rows, block, channels)
        rests.append(resynthesise(mixed, heard, reference, gate))
        groups += names
    _restore_clock(response, reference)
    latency = reference.clock.latency
    return Evidence(
        recording=recording,
        finite=finite,
        response=response,
        reference=reference,
        energies=EnergyMap(
            octaves,
            np.concatenate(energies),
            float(latency) if np.isfinite(latency) else 0.0,
            n,
        ),
        residual=Residual(
            np.concatenate([rest.unexplained for rest in rests]),
            np.concatenate([rest.whole for rest in rests]),
            rests[0].block_s,
        ),
        groups=groups,
        golden=golden,
        direct_delay=direct_delay,
        limits=limits,
    )


def _keep(lags: Array, into: Array, excitation: Excitation) -> None:
    pre = excitation.pre
    if pre:
        into[:, :pre] = lags[:, -pre:]
    into[:, pre:] = lags[:, : excitation.length]


def _group(
    lags: Array, rows: Array, block: NDArray[np.intp], channels: int
) -> tuple[Array, Array, list[list[int]]]:
    """Mix channels of a large array, so that events cost a quarter to look for.

    Lost samples hit all channels; a knock in one channel stands 6 dB lower in the
    mix of four, still far above the limits. Signs alternate, so that equal channels
    do not only add up.
    """
    names = [[int(channel)] for channel in block]
    if channels <= CHANNELS_SINGLE:
        return lags, rows, names
    level = np.sqrt(np.einsum("cn,cn->c", rows, rows) / rows.shape[1])
    weight = np.where(level > 0, 1 / np.where(level > 0, level, 1), 0)
    weight *= np.resize([1.0, 1.0, -1.0, 1.0], weight.size)
    return (
        np.einsum("c,cn->n", weight, lags)[np.newaxis],
        np.einsum("c,cn->n", weight, rows)[np.newaxis],
        [[int(channel) for channel in block]],
    )


def _restore_clock(response: Array, reference: Reference) -> None:
    """Put responses on the player's clock: the recorder's may have run off."""
    clock, pre = reference.clock, reference.excitation.pre
    if not clock.runs_off or not np.isfinite(clock.latency):
        return
    factor = 1 / (1 + clock.drift)
    for row in response:
        row[:] = factor * apply_stretch(row, factor - 1, pre * (1 - factor))
