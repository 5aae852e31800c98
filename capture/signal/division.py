"""Divide the channels of a take, a few at a time, in two threads."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.signal.crests import Crests, measure_crests
from capture.signal.energy import Octaves
from capture.signal.excitation import Excitation
from capture.signal.reference import SweepReference
from capture.signal.residual import Residual, compare_blocks, lag_gate, resynthesise

__all__ = ["Divider", "divide"]

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

THREADS = 2  # each transform uses two workers of its own: four cores are busy
CHANNELS_PER_GROUP = 8  # a knock in one of eight stands 9 dB lower: still found
CHANNELS_AT_ONCE = 1  # one channel's spectra fit the cache of a core
CHANNELS_SINGLE = 8  # up to here each channel is looked at by itself


def divide(recording: Array, reference: SweepReference) -> Array:
    """Return the responses of a recording without looking at anything else.

    Parameters
    ----------
    recording : ndarray, shape (channels, n)
        What was recorded.
    reference : SweepReference
        What to divide by.

    Returns
    -------
    ndarray, shape (channels, pre + length)
    """
    excitation = reference.excitation
    response = np.empty((len(recording), excitation.pre + excitation.length))
    factor = reference.reciprocal

    def work(few: slice) -> None:
        spectra = excitation.transform(centered(recording[few], excitation))
        spectra *= factor
        keep(excitation.inverse(spectra), response[few], excitation)

    with ThreadPoolExecutor(THREADS) as pool:
        list(pool.map(work, _slices(0, len(recording))))
    return response


def centered(rows: Array, excitation: Excitation) -> Array:
    """Return channels without their mean, zeros behind, shape (channels, grid)."""
    padded = np.zeros((len(rows), excitation.n))
    np.subtract(rows, rows.mean(axis=1, keepdims=True), out=padded[:, : rows.shape[1]])
    return padded


def keep(lags: Array, into: Array, excitation: Excitation) -> None:
    """Take what is wanted from the grid of lags; negative lags are at its end."""
    pre = excitation.pre
    into[:, :pre] = lags[:, excitation.n - pre :]
    into[:, pre:] = lags[:, : excitation.length]


def _slices(first: int, last: int) -> Iterator[slice]:
    for start in range(first, last, CHANNELS_AT_ONCE):
        yield slice(start, min(start + CHANNELS_AT_ONCE, last))


@dataclass(frozen=True, eq=False)
class DividedChannels:
    """What was found in a few channels."""

    energy: Array
    """See `capture.signal.energy`. Shape (channels, octaves, blocks)."""
    residual: Residual
    """Of each group."""
    groups: list[list[int]]
    """Channels of each group."""
    crests: Crests | None
    """Of each channel; None in large arrays."""


class Divider:
    """Everything that dividing the channels of one take needs.

    Channels of a large array are mixed in groups, so that events cost an eighth to
    look for: lost samples hit all channels; a knock in one channel stands 9 dB lower
    in the mix of eight, still far above the limits. Signs alternate, so that equal
    channels do not only add up.

    Parameters
    ----------
    reference : SweepReference
        What to divide by.
    octaves : Octaves
        Where energies are measured.
    recording : ndarray, shape (channels, n)
        What was recorded, finite.
    response : ndarray, shape (channels, pre + length)
        Where the responses go.
    """

    def __init__(
        self,
        reference: SweepReference,
        octaves: Octaves,
        recording: Array,
        response: Array,
    ) -> None:
        self._reference, self._octaves = reference, octaves
        self._recording, self._response = recording, response
        self._channels, self._n = recording.shape
        self._mixes = self._channels > CHANNELS_SINGLE
        self._gate = lag_gate(reference, self._n)
        self._linear = lag_gate(reference, self._n, ())

    def parts(self) -> list[DividedChannels]:
        """Divide all channels."""
        firsts = range(0, self._channels, CHANNELS_PER_GROUP)
        _ = self._reference.reciprocal, self._reference.spectrum
        if len(firsts) == 1 or THREADS < 2:
            return [self._part(first) for first in firsts]
        with ThreadPoolExecutor(THREADS) as pool:
            return list(pool.map(self._part, firsts))

    def _part(self, first: int) -> DividedChannels:
        last = min(first + CHANNELS_PER_GROUP, self._channels)
        work = self._mixed if self._mixes else self._single
        return work(first, last)

    def _divided(self, few: slice) -> tuple[Array, Array, Array]:
        """Return recordings, lags and energies of a few channels."""
        excitation = self._reference.excitation
        rows = centered(self._recording[few], excitation)
        spectra = excitation.transform(rows)
        spectra *= self._reference.reciprocal
        energy = self._octaves.measure(spectra)
        lags = excitation.inverse(spectra)
        keep(lags, self._response[few], excitation)
        return rows[:, : self._n], lags, energy

    def _single(self, first: int, last: int) -> DividedChannels:
        rate = self._reference.excitation.sample_rate
        energies, rests, crests = [], [], []
        for few in _slices(first, last):
            rows, lags, energy = self._divided(few)
            rest = resynthesise(lags, self._reference, self._gate, self._n)
            rests.append(compare_blocks(rest, rows, rate))
            rest = resynthesise(lags, self._reference, self._linear, self._n)
            crests.append(measure_crests(rows, rest, rate))
            energies.append(energy)
        groups = [[channel] for channel in range(first, last)]
        residual = Residual.joined(rests)
        return DividedChannels(
            np.concatenate(energies), residual, groups, Crests.joined(crests)
        )

    def _mixed(self, first: int, last: int) -> DividedChannels:
        excitation = self._reference.excitation
        mixed, heard = np.zeros((1, excitation.n)), np.zeros((1, self._n))
        energies = [self._mix(few, heard[0], mixed[0]) for few in _slices(first, last)]
        rest = resynthesise(mixed, self._reference, self._gate, self._n)
        residual = compare_blocks(rest, heard, excitation.sample_rate)
        groups = [list(range(first, last))]
        return DividedChannels(np.concatenate(energies), residual, groups, None)

    def _mix(self, few: slice, heard: Array, mixed: Array) -> Array:
        """Divide a few channels, add them to the mixes and return their energies."""
        rows, lags, energy = self._divided(few)
        level = np.sqrt(np.einsum("cn,cn->c", rows, rows) / self._n)
        weight = np.where(level > 0, 1 / np.where(level > 0, level, 1), 0)
        weight *= np.where(np.arange(few.start, few.stop) % 4 == 2, -1.0, 1.0)
        for row, lag, share in zip(rows, lags, weight, strict=True):
            row *= share
            lag *= share
            heard += row
            mixed += lag
        return energy
