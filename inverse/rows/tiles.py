"""Time-frequency tiles: octaves and short bins, measured and scaled."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from rir.bands import crossover_gains

__all__ = ["Tiles"]

LOWEST_HZ = 125.0  # ISO 3382-1's lowest octave; rooms below have single modes
SHORT_S, SHORT_BIN_S, LONG_BIN_S = 0.25, 0.005, 0.01
"""Bins of 5 ms, below which low octaves' filters ring; twice that in responses longer
than 0.25 s, which keeps bins few (decision 0059)."""
CHUNK_SAMPLES = 2**18  # 2 MB of octaves at once: a core's own cache
RINGING_S = 0.02  # shorter, the lowest octave's filter wraps round; longer costs time
SILENT = 1e-12  # of the loudest tile's energy: rounding, not sound
STEP_BINS, WORTH = 16, 0.7
"""Silent ends are cut off in steps of so many bins, where that saves so much."""


@dataclass(frozen=True)
class Tiles:
    """Divide responses into octaves and bins."""

    sample_rate: float
    """Hertz."""
    n_samples: int
    """Length of a response."""
    bin_length: int = 0
    """Samples of a bin; 0 chooses by the length of a response."""

    @cached_property
    def centers(self) -> np.ndarray:
        """Middles of the octaves below the Nyquist frequency, hertz."""
        count = int(np.floor(np.log2(max(0.45 * self.sample_rate / LOWEST_HZ, 1))))
        return LOWEST_HZ * 2.0 ** np.arange(max(count, 0) + 1)

    @cached_property
    def bin_samples(self) -> int:
        """Length of a bin."""
        if self.bin_length:
            return self.bin_length
        short = self.n_samples <= SHORT_S * self.sample_rate
        length = SHORT_BIN_S if short else LONG_BIN_S
        return max(round(length * self.sample_rate), 1)

    @property
    def bin_s(self) -> float:
        """Length of a bin, seconds."""
        return self.bin_samples / self.sample_rate

    @property
    def bins(self) -> int:
        """Number of bins; the last may be cut."""
        return -(-self.n_samples // self.bin_samples)

    @property
    def times(self) -> np.ndarray:
        """Middles of the bins, seconds, shape (bins,)."""
        return (np.arange(self.bins) + 0.5) * self.bin_s

    @property
    def widths(self) -> np.ndarray:
        """Effective bandwidths of the octaves, hertz, shape (bands,)."""
        square = (self._masks**2).sum(axis=1)
        return square / square.sum() * 0.5 * self.sample_rate

    @cached_property
    def _length(self) -> int:
        from scipy.fft import next_fast_len

        tail = round(RINGING_S * self.sample_rate)
        return next_fast_len(self.n_samples + tail, True) or self.n_samples + tail

    @cached_property
    def _masks(self) -> np.ndarray:
        if len(self.centers) == 1:
            return np.ones((1, self._length // 2 + 1))
        rate = round(self.sample_rate)
        return crossover_gains(tuple(map(float, self.centers)), rate, self._length)

    def split(self, responses: np.ndarray) -> np.ndarray:
        """Return the octaves of responses, shape (rows, bands, n_samples).

        Their sum is the response again.
        """
        from scipy.fft import irfft, rfft

        spectra = np.asarray(rfft(responses, self._length, axis=-1))
        parts = irfft(spectra[:, None] * self._masks, self._length, axis=-1)
        return np.asarray(parts)[..., : self.n_samples]

    def sums(self, values: np.ndarray) -> np.ndarray:
        """Return sums over each bin of the last axis."""
        starts = np.arange(self.bins) * self.bin_samples
        return np.add.reduceat(values, starts, axis=-1)

    def energies(self, responses: np.ndarray) -> np.ndarray:
        """Return energies, shape (rows, bands, bins)."""
        return self.products(responses, responses)

    def products(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Return inner products in each tile, shape (rows, bands, bins)."""
        out = np.zeros((len(first), len(self.centers), self.bins))
        short = self._sounding(first, second)
        if short is not self:
            cut = slice(0, short.n_samples)
            begun = first[:, cut]
            other = begun if first is second else second[:, cut]
            out[..., : short.bins] = short.products(begun, other)
            return out
        for start in range(0, len(first), self._chunk):
            rows = slice(start, start + self._chunk)
            parts = self.split(first[rows])
            others = parts if first is second else self.split(second[rows])
            out[rows] = self.sums(parts * others)
        return out

    def compared(
        self, measured: np.ndarray, predicted: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return energies of predictions, and their products with right and wrong rows.

        Each of shape (rows, bands, bins); the last are products of measured rows
        with the prediction of the row before.
        """
        shape = 3, len(predicted), len(self.centers), self.bins
        out = np.zeros(shape)
        short = self._sounding(predicted)
        if short is not self:
            cut = slice(0, short.n_samples)
            found = short.compared(measured[:, cut], predicted[:, cut])
            out[..., : short.bins] = found
            return out[0], out[1], out[2]
        before = self.split(predicted[-1:])
        for start in range(0, len(predicted), self._chunk):
            rows = slice(start, start + self._chunk)
            true, parts = self.split(measured[rows]), self.split(predicted[rows])
            wrong = np.concatenate([before, parts[:-1]])
            before = parts[-1:]
            for one, pair in enumerate(((parts, parts), (true, parts), (true, wrong))):
                out[one, rows] = self.sums(pair[0] * pair[1])
        return out[0], out[1], out[2]

    def gained(self, responses: np.ndarray, gains: np.ndarray) -> np.ndarray:
        """Return responses with a gain in each tile, smooth between bins.

        Parameters
        ----------
        responses : numpy.ndarray
            Shape (rows, n_samples).
        gains : numpy.ndarray
            Amplitude gains, shape (rows, bands, bins). Where all are 1 the
            response comes back untouched.
        """
        out = responses.copy()
        short = self._sounding(responses)
        if short is not self:
            cut = slice(0, short.n_samples)
            out[:, cut] = short.gained(responses[:, cut], gains[..., : short.bins])
            return out
        for start in range(0, len(responses), self._chunk):
            rows = slice(start, start + self._chunk)
            change = gains[rows] - 1
            if change.any():
                out[rows] += self._weighted(self.split(responses[rows]), change)
        return out

    def joined(self, parts: np.ndarray, gains: np.ndarray) -> np.ndarray:
        """Return the sum of octaves that all rows share, with gains of their own.

        Parameters
        ----------
        parts : numpy.ndarray
            What :meth:`split` returned of one response, shape (bands, n_samples).
        gains : numpy.ndarray
            Shape (rows, bands, bins).
        """
        out = np.empty((len(gains), self.n_samples))
        for low, high, here, part in self._pieces:
            late = parts[:, here] * part
            out[:, here] = gains[..., low] @ (parts[:, here] - late)
            out[:, here] += gains[..., high] @ late
        return out

    def _weighted(self, parts: np.ndarray, gains: np.ndarray) -> np.ndarray:
        """Return the sum of each row's octaves with gains, smooth between bins."""
        out = np.empty((len(parts), self.n_samples))
        for low, high, here, part in self._pieces:
            early, late = gains[..., low], gains[..., high]
            wave = early[..., None] + (late - early)[..., None] * part
            out[:, here] = (wave * parts[..., here]).sum(axis=1)
        return out

    def _sounding(self, *each: np.ndarray) -> "Tiles":
        """Return tiles of as much as one of the arrays sounds, its ringing included."""
        last = min(_length(one) for one in each)
        step = STEP_BINS * self.bin_samples
        kept = -(-(last + round(RINGING_S * self.sample_rate)) // step) * step
        if kept > WORTH * self.n_samples:
            return self
        return _tiles(self.sample_rate, kept, self.bin_samples)

    @property
    def _chunk(self) -> int:
        """Rows whose octaves a fast memory holds."""
        return max(CHUNK_SAMPLES // (len(self.centers) * self._length), 1)

    @cached_property
    def _pieces(self) -> list[tuple[int, int, slice, np.ndarray]]:
        """Bins on both sides of runs of samples, and how near the later one is."""
        place = (np.arange(self.n_samples) + 0.5) / self.bin_samples - 0.5
        low = np.clip(np.floor(place).astype(int), 0, max(self.bins - 2, 0))
        part = np.clip(place - low, 0.0, 1.0)
        edges = np.flatnonzero(np.diff(low, prepend=-1))
        runs = zip(edges, [*edges[1:], self.n_samples], strict=True)
        return [
            (int(low[a]), min(int(low[a]) + 1, self.bins - 1), slice(a, b), part[a:b])
            for a, b in runs
        ]


@lru_cache(maxsize=32)
def _tiles(sample_rate: float, n_samples: int, bin_length: int) -> Tiles:
    return Tiles(sample_rate, n_samples, bin_length)


def _length(responses: np.ndarray) -> int:
    """Return the samples up to the last sound."""
    nonzero = np.flatnonzero((responses != 0).any(axis=0))
    return int(nonzero[-1]) + 1 if len(nonzero) else 0
