"""Fit every pair of a room and name the outliers."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.likeness.faults import FaultLimits, PairFault, Typical, name_faults
from analysis.likeness.fit import SwapFit, fit_swap
from analysis.likeness.quiet import quiet_part
from rir.arrays import FloatArray

__all__ = ["RoomLikeness", "fit_room", "noise_levels", "noise_power"]


@dataclass(frozen=True)
class RoomLikeness:
    """Fits and faults of each pair of a room."""

    fits: list[SwapFit]
    faults: list[list[PairFault]]
    """Likeliest first; empty for a pair without one."""
    noise_db: FloatArray
    """Noise power of forward and reverse, re the largest sample squared [dB]. Shape
    (n_pairs, 2)."""
    typical: Typical
    """What most pairs share; an outlier is one that differs from it."""

    def share(self, kind: str) -> float:
        """Return the share of pairs that have a fault of a kind."""
        having = [any(f.kind == kind for f in found) for found in self.faults]
        return float(np.mean(having)) if having else 0.0


def noise_levels(responses: FloatArray, sample_rate: int) -> FloatArray:
    """Return noise power over peak power of responses (k, n) [dB], shape (k,)."""
    power = np.array([noise_power(h, sample_rate) for h in responses])
    peak = np.max(responses**2, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(10 * np.log10(power / peak))


def noise_power(samples: FloatArray, sample_rate: int) -> float:
    """Return the mean square of the quiet part of a response."""
    return float(np.mean(quiet_part(samples, sample_rate) ** 2))


def fit_room(
    forward: Sequence[FloatArray],
    reverse: Sequence[FloatArray],
    names: Sequence[str],
    sample_rate: int,
    limits: FaultLimits | None = None,
) -> RoomLikeness:
    """Fit the pairs of one room.

    Parameters
    ----------
    forward, reverse : sequence of ndarray, shape (n,)
        Both directions of each pair.
    names : sequence of str
        How a person calls each pair.
    sample_rate : int
        Samples per second [Hz].
    limits : FaultLimits, optional
        From which sizes on something is a fault.
    """
    levels = np.array([noise_power(h, sample_rate) for h in (*forward, *reverse)])
    levels = levels.reshape(2, -1).T
    fits = [fit_swap(f, r, sample_rate) for f, r in zip(forward, reverse, strict=True)]
    alike = _partners(forward, reverse, sample_rate)
    typical = Typical.of(fits)
    bounds = (limits or FaultLimits()).widened(typical)
    excess = 10 * np.log10(np.maximum(levels, 1e-300) / _typical(levels))
    faults = [
        name_faults(
            fit,
            noise_excess_db=_excess(excess[k]),
            own=float(alike[k, k]),
            partners=[
                (names[j], float(alike[k, j])) for j in range(len(names)) if j != k
            ],
            limits=bounds,
        )
        for k, fit in enumerate(fits)
    ]
    relative = np.stack(
        [noise_levels(np.stack(h), sample_rate) for h in (forward, reverse)], axis=1
    )
    return RoomLikeness(fits, faults, relative, typical)


def _excess(levels: FloatArray) -> float:
    """Return how far the noisier direction stands out; 0 if both are alike.

    What rises in both directions is a decay that outlasts the record.
    """
    return float(levels.max()) if abs(levels[1] - levels[0]) > 5.0 else 0.0


def _typical(levels: FloatArray) -> float:
    return max(float(np.median(levels)), 1e-300)


def _partners(
    forward: Sequence[FloatArray], reverse: Sequence[FloatArray], sample_rate: int
) -> FloatArray:
    """Return correlations of every reverse with every forward response under 1 kHz."""
    from scipy.fft import rfft

    count = min(len(forward[0]), round(0.3 * sample_rate))
    step = sample_rate / count
    kept = slice(max(1, round(80 / step)), round(1000 / step) + 1)

    def unit(responses: Sequence[FloatArray]) -> NDArray[np.complex128]:
        rows = [np.asarray(rfft(h[:count]), dtype=complex)[kept] for h in responses]
        stacked = np.stack(rows)
        size = np.linalg.norm(stacked, axis=1, keepdims=True)
        return np.asarray(stacked / np.where(size > 0, size, 1.0), dtype=complex)

    return np.real(unit(reverse) @ unit(forward).conj().T)
