"""What a recording holds beyond the response played through the excitation."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.signal.energy import BLOCK_S
from capture.signal.reference import SweepReference

__all__ = ["Residual", "compare_blocks", "lag_gate", "resynthesise"]

Array = NDArray[np.float64]

ORDERS = (2, 3)  # higher harmonics lie below the limit of an event
LEAD_S = 0.03  # the lower slope's ringing before the response
RING_S = 0.2  # and after it
PACKET_S = 0.15  # a harmonic with its early decay


@dataclass(frozen=True, eq=False)
class Residual:
    """Energies of the unexplained and of the whole sound in 10 ms blocks.

    Attributes
    ----------
    unexplained, whole : ndarray, shape (channels, blocks)
        Energy per block.
    block_s : float
        Length of a block, s.
    """

    unexplained: Array
    whole: Array
    block_s: float

    @staticmethod
    def joined(parts: "Sequence[Residual]") -> "Residual":
        """Return several as one."""
        return Residual(
            np.concatenate([part.unexplained for part in parts]),
            np.concatenate([part.whole for part in parts]),
            parts[0].block_s,
        )


def lag_gate(
    reference: SweepReference, n_recorded: int, orders: tuple[int, ...] = ORDERS
) -> NDArray[np.float32]:
    """Return 1 at lags that are *not* the response, 0 where it and harmonics lie.

    Parameters
    ----------
    reference : SweepReference
        Gives the grid of lags.
    n_recorded : int
        Samples of the recording.
    orders : tuple of int
        Harmonics that count as explained.
    """
    excitation = reference.excitation
    rate = excitation.sample_rate
    gate = np.ones(excitation.n, dtype=np.float32)
    latency = reference.clock.latency
    tail = n_recorded - excitation.n_played
    tail -= int(latency) if np.isfinite(latency) else 0
    stop = max(tail, excitation.length, int(0.05 * rate)) + int(RING_S * rate)
    gate[: min(stop, excitation.n)] = 0
    gate[-max(excitation.pre, int(LEAD_S * rate)) :] = 0
    for order in orders:
        at = int(excitation.rate * np.log(order) * rate)
        width = int(PACKET_S * rate)
        if at > int((LEAD_S + 0.01) * rate):
            first = excitation.n - at - int(0.01 * rate)
            gate[max(first, 0) : min(first + width, excitation.n)] = 0
    return gate


def resynthesise(
    responses: Array,
    reference: SweepReference,
    gate: NDArray[np.float32],
    n_recorded: int,
) -> NDArray[np.float32]:
    """Play what lies outside the gate: what of a recording is unexplained.

    Parameters
    ----------
    responses : ndarray, shape (channels, n)
        Deconvolved channels on the whole grid.
    reference : SweepReference
        What they were divided by.
    gate : ndarray, shape (n,)
        See `lag_gate`.
    n_recorded : int
        Samples of the recording.

    Returns
    -------
    ndarray, shape (channels, n_recorded)
    """
    fft: Any = import_module("scipy.fft")
    outside = responses.astype(np.float32) * gate
    spectra = fft.rfft(outside, workers=2)
    spectra *= reference.spectrum.astype(np.complex64)
    rest = fft.irfft(spectra, reference.excitation.n, workers=2, overwrite_x=True)
    return rest[:, :n_recorded]


def compare_blocks(
    unexplained: NDArray[np.float32], recordings: Array, sample_rate: float
) -> Residual:
    """Measure unexplained and whole sound block by block.

    Parameters
    ----------
    unexplained, recordings : ndarray, shape (channels, n)
        Signals.
    sample_rate : float
        Sampling rate, Hz.
    """
    size = max(round(BLOCK_S * sample_rate), 8)
    return Residual(
        block_energies(unexplained, size),
        block_energies(recordings, size),
        size / sample_rate,
    )


def block_energies(signals: Array | NDArray[np.float32], size: int) -> Array:
    """Return energies of whole blocks, shape (channels, blocks)."""
    count = signals.shape[1] // size
    blocks = signals[:, : count * size].reshape(signals.shape[0], count, size)
    return np.einsum("cbs,cbs->cb", blocks, blocks, dtype=np.float64)
