"""Where the energy of a deconvolved take lies: by octave and by lag."""

from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.signal.excitation import Excitation

__all__ = ["EnergyMap", "Octaves"]

Array = NDArray[np.float64]

BLOCK_S = 0.01  # finer than decays, coarse enough for some freedoms an octave
EDGE_SHARE = 0.05  # of the octave: keeps its ringing below a block
SLOWEST_HZ = 200.0  # two points a block at least


class Octaves:
    """Octave bands of one excitation and the grid of lags.

    Parameters
    ----------
    excitation : Excitation
        Gives rate, grid and band.

    Attributes
    ----------
    centers : ndarray
        Nominal centre frequencies, Hz.
    lags : ndarray, shape (blocks,)
        Centre of each 10 ms block, s; negative ones at the end.
    """

    def __init__(self, excitation: Excitation) -> None:
        self._fft: Any = import_module("scipy.fft")
        self.excitation = excitation
        rate, n = excitation.sample_rate, excitation.n
        low, high = excitation.band
        centers = 1000.0 * 2.0 ** np.arange(-5, 6)
        keep = (centers / 2**0.5 > 0.9 * low) & (centers * 2**0.5 < 1.2 * high)
        self.centers: Array = np.asarray(centers[keep], dtype=np.float64)
        if not self.centers.size:
            self.centers = np.array([np.sqrt(low * high)])
        self.n_blocks = max(int(n / rate / BLOCK_S), 8)
        self.block_s = n / rate / self.n_blocks
        index = np.arange(self.n_blocks)
        first_negative = (n - excitation.n_played - excitation.pre) / n * self.n_blocks
        negative = index >= max(first_negative, self.n_blocks / 2)
        steps = np.where(negative, index - self.n_blocks, index) + 0.5
        self.lags: Array = np.asarray(steps * self.block_s, dtype=np.float64)
        self._windows = [self._window(center) for center in self.centers]

    def _window(
        self, center: float
    ) -> tuple[int, int, NDArray[np.float32], int, NDArray[np.intp]]:
        step = self.excitation.sample_rate / self.excitation.n
        first = max(int(center / 2**0.5 / step), 1)
        last = min(int(center * 2**0.5 / step), self.excitation.n // 2)
        size = last - first
        edge = max(int(EDGE_SHARE * size), 1)
        window = np.ones(size, dtype=np.float32)
        ramp = np.sin(np.pi / 2 * (np.arange(edge) + 0.5) / edge)
        window[:edge] *= ramp
        window[-edge:] *= ramp[::-1]
        seconds = self.excitation.n / self.excitation.sample_rate
        points = self._fft.next_fast_len(max(size, int(SLOWEST_HZ * seconds)))
        edges = np.round(np.arange(self.n_blocks) * points / self.n_blocks)
        return first, last, window, points, edges.astype(np.intp)

    def measure(self, spectra: NDArray[np.complex128]) -> Array:
        """Return energies of responses, shape (channels, octaves, blocks).

        Parameters
        ----------
        spectra : ndarray, shape (channels, bins)
            Spectra of the deconvolved channels.
        """
        channels = spectra.shape[0]
        result = np.empty((channels, self.centers.size, self.n_blocks))
        for index, (first, last, window, points, edges) in enumerate(self._windows):
            part = spectra[:, first:last].astype(np.complex64) * window
            wave = self._fft.ifft(part, points, workers=2, overwrite_x=True)
            power = wave.real**2 + wave.imag**2
            sums = np.add.reduceat(power, edges, axis=-1)
            result[:, index] = sums * (2.0 * points / self.excitation.n)
        return result


@dataclass(frozen=True, eq=False)
class EnergyMap:
    """Energies of a take's channels with what part of them is noise."""

    octaves: Octaves
    """The grid."""
    energy: Array
    """Energy by octave and lag. Shape (channels, octaves, blocks)."""
    latency: float
    """Samples before the emission in the recording."""
    n_recorded: int
    """Samples of the recording."""

    @property
    def centers(self) -> Array:
        """Centre frequencies, Hz."""
        return self.octaves.centers

    @property
    def lags(self) -> Array:
        """Lags, s."""
        return self.octaves.lags

    @cached_property
    def valid(self) -> NDArray[np.bool_]:
        """The lags that the recording covers, shape (octaves, blocks)."""
        excitation = self.octaves.excitation
        rate = excitation.sample_rate
        played = excitation.time_played(self.centers)[:, np.newaxis]
        half = 0.35 * abs(excitation.rate)
        at = self.lags + played + self.latency / rate
        end = self.n_recorded / rate
        return (at - half > 0) & (at + half < end)
