"""Half octaves as slow complex envelopes, and the shape of an arrival in each.

A response is the sum of its half octaves; each is kept as an envelope of few samples,
so that an image costs a dozen taps a band whatever the sample rate.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rir.arrays import ComplexArray, FloatArray

__all__ = ["HalfOctaves", "Interior", "Kernels", "LoopInput"]

LOWEST_HZ = 20.0  # the limit of hearing
PAD_S = 0.03  # behind a response, so that filters of its end do not reach its start
SPARE = 1.6
"""Envelope samples over the bins of a band."""
FRACTIONS, TAPS, MOST_TAPS = 64, 14, 48
"""Nodes a sample, taps of an arrival (decision 0057), and length of an envelope that is
short enough to take whole."""


class Kernels(NamedTuple):
    """Hold what a compiled loop needs to add an arrival to all bands.

    Parameters
    ----------
    starts, lengths : ndarray of int, shape (bands,)
        Where each band's envelope stands in a flat row.
    turns, rates : ndarray, shape (bands,)
        Radians of the band's middle a sample, envelope samples a sample.
    taps, slopes : ndarray, shape (bands, FRACTIONS + 1, MOST_TAPS)
        Complex taps by the fraction of an envelope sample, and their derivatives by
        the arrival time in samples.
    widths : ndarray of int, shape (bands,)
        Taps that count; short bands hold their whole period.
    """

    starts: NDArray[np.int64]
    lengths: NDArray[np.int64]
    turns: FloatArray
    rates: FloatArray
    taps: ComplexArray
    slopes: ComplexArray
    widths: NDArray[np.int64]


class Interior(NamedTuple):
    """Hold what a box is made of in half octaves.

    Fields are those of `BandedRoom`; `least` and `order` are the fewest and the most
    reflections of an image.
    """

    walls: ComplexArray
    angled: bool
    loss: FloatArray
    emitting: FloatArray
    listening: FloatArray
    least: int
    order: int


class LoopInput(NamedTuple):
    """Hold what every compiled loop over half octaves starts from, in their order.

    Parameters
    ----------
    ends : tuple
        Places of both ends and turns into their frames, as of `BoxRoom.ends`.
    geometry : tuple
        Corners, scale, latency and reach, as of `BoxRoom.geometry`.
    interior : Interior
        Walls, air, devices and orders of the room.
    kernels : Kernels
        Arrivals.
    """

    ends: tuple[FloatArray, FloatArray, FloatArray, FloatArray]
    geometry: tuple[FloatArray, FloatArray, float, float, float]
    interior: Interior
    kernels: Kernels


@dataclass(frozen=True)
class HalfOctaves:
    """Divide responses of `n_samples` at `sample_rate` into half octaves."""

    sample_rate: float
    n_samples: int

    @cached_property
    def size(self) -> int:
        """Length of the spectra's period, samples."""
        from scipy.fft import next_fast_len

        padded = self.n_samples + round(PAD_S * self.sample_rate)
        return int(next_fast_len(padded, True) or padded)

    @cached_property
    def centers(self) -> FloatArray:
        """Middles of the bands, hertz."""
        top = 0.5 * self.sample_rate
        count = max(int(2 * np.log2(max(top / LOWEST_HZ, 1.0))), 1)
        centers = top * 2.0 ** (-0.5 * np.arange(count, -1, -1))
        return np.asarray(centers, dtype=np.float64)

    @property
    def bands(self) -> int:
        """Number of bands."""
        return len(self.centers)

    @cached_property
    def hertz(self) -> FloatArray:
        """Frequencies of the spectra's bins."""
        hertz = np.fft.rfftfreq(self.size, 1 / self.sample_rate)
        return np.asarray(hertz, dtype=np.float64)

    @cached_property
    def masks(self) -> FloatArray:
        """Weights of the bins in each band, shape (bands, bins).

        They add up to 1 from the middle of the first band on, and fall to 0 below.
        """
        place = 2 * np.log2(np.maximum(self.hertz, 1e-3) / self.centers[0])
        place = np.minimum(place, self.bands - 1)
        gap = np.abs(place - np.arange(self.bands)[:, None])
        weights = np.cos(0.5 * np.pi * np.clip(gap, 0, 1)) ** 2
        return np.asarray(weights, dtype=np.float64)

    @cached_property
    def spans(self) -> NDArray[np.int64]:
        """First and one past the last bin of each band, shape (bands, 2)."""
        held = self.masks > 1e-9
        last = held.shape[1] - np.argmax(held[:, ::-1], axis=1)
        return np.stack([np.argmax(held, axis=1), last], axis=1).astype(np.int64)

    @cached_property
    def lengths(self) -> NDArray[np.int64]:
        """Envelope samples of each band."""
        from scipy.fft import next_fast_len

        wide = (self.spans[:, 1] - self.spans[:, 0]) * SPARE
        least = np.maximum(np.ceil(wide), 2 * TAPS).astype(int)
        return np.array([next_fast_len(int(n)) for n in least], dtype=np.int64)

    @cached_property
    def starts(self) -> NDArray[np.int64]:
        """Place of each band's first sample in a flat row."""
        return np.concatenate([[0], np.cumsum(self.lengths)[:-1]]).astype(np.int64)

    @property
    def total(self) -> int:
        """Envelope samples of a flat row."""
        return int(self.lengths.sum())

    @cached_property
    def middles(self) -> NDArray[np.int64]:
        """Bin each band is turned down by."""
        return self.spans.sum(axis=1) // 2

    def split(self, spectra: ComplexArray, weight: FloatArray) -> ComplexArray:
        """Return envelopes of weighted spectra, shape (rows, total)."""
        out = np.empty((len(spectra), self.total), dtype=np.complex128)
        for band, (first, last) in enumerate(self.spans.tolist()):
            length = int(self.lengths[band])
            mine = spectra[:, first:last] * self.masks[band, first:last]
            mine = mine * weight[first:last]
            bins = (np.arange(first, last) - self.middles[band]) % length
            turned = np.zeros((len(spectra), length), dtype=np.complex128)
            turned[:, bins] = mine
            start = int(self.starts[band])
            out[:, start : start + length] = np.fft.ifft(turned, axis=1)
        return out

    def joined(self, envelopes: ComplexArray) -> ComplexArray:
        """Return the spectra of envelopes whose arrivals hold their masks."""
        out = np.zeros((len(envelopes), len(self.hertz)), dtype=np.complex128)
        for band, (first, last) in enumerate(self.spans.tolist()):
            start, length = int(self.starts[band]), int(self.lengths[band])
            turned = np.fft.fft(envelopes[:, start : start + length], axis=1)
            bins = (np.arange(first, last) - self.middles[band]) % length
            out[:, first:last] += turned[:, bins]
        return out

    def kernels(self, weight: FloatArray) -> Kernels:
        """Return arrivals of a source of spectrum `weight`, shape (bins,)."""
        return _arrivals(self, np.asarray(weight, dtype=np.float64).tobytes())


@lru_cache(maxsize=4)
def _arrivals(grid: HalfOctaves, weights: bytes) -> Kernels:
    weight = np.frombuffer(weights)
    fractions = np.arange(FRACTIONS + 1) / FRACTIONS
    shape = grid.bands, FRACTIONS + 1, MOST_TAPS
    taps, slopes = np.zeros(shape, complex), np.zeros(shape, complex)
    widths = np.where(grid.lengths <= MOST_TAPS, grid.lengths, TAPS)
    for band, (first, last) in enumerate(grid.spans.tolist()):
        length, bins = int(grid.lengths[band]), np.arange(first, last)
        mine = grid.masks[band, first:last] * weight[first:last] / length
        phase = 2j * np.pi * (bins - grid.middles[band]) / length
        width = int(widths[band])
        at = np.arange(width) - width // 2 + 1 - fractions[:, None]
        wave = np.exp(phase * at[..., None])
        taps[band, :, :width] = wave @ mine
        slope = mine * (-2j * np.pi * bins / grid.size)
        slopes[band, :, :width] = wave @ slope
    turns = 2 * np.pi * grid.middles / grid.size
    rates = grid.lengths / grid.size
    return Kernels(grid.starts, grid.lengths, turns, rates, taps, slopes, widths)
