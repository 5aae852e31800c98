"""Stored responses, interpolated after their direct sounds are laid on each other.

A field answers a place it has no row of by a mean of the nearest rows, in both orders
of the ends. Before it is taken, each row is moved to the arrival of the wanted direct
sound and raised to its level, so that direct sounds add up and do not comb.

Rows may also be near by where the listener stands in the frame of the emitter: what a
loudspeaker with a pattern sends there is the same from any place.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inverse.rows.directivity import aimed_offsets
from inverse.rows.fitset import FitSet
from rir import Poses
from rir.arrays import FloatArray

__all__ = ["AlignedRows", "squares"]

NEIGHBOURS = 6  # rows mixed: one to each side along three axes
NEAREST_M = 0.1
"""Nearer ends count as so far apart in the 1/r law: the size of a driver."""
SAME_M = 0.02  # places so near are one: an emitter put back by hand stands within it
APART_M = 0.3  # with one emitter, rows of listeners so near would tell almost the same
FAINT = 0.05
"""Weight of places beside aims: among rows aimed alike the nearer ones come first."""
MOST_ROWS = 2000  # rows kept: some megabytes of a file; more are hardly nearer
CHUNK = 32  # queries at once: their spectra, six each, stay within tens of megabytes
FAR = 1e9  # square metres; stands for rows that may not be asked


@dataclass(frozen=True, eq=False)
class AlignedRows:
    """Hold rows to interpolate between.

    Parameters
    ----------
    responses : ndarray, shape (rows, n)
        Stored responses, float32.
    emitters, listeners : ndarray, shape (rows, 3)
        Their ends.
    samples_a_metre : float
        Sample rate over speed of sound.
    offsets : ndarray, shape (rows, 3)
        Listeners in the frame of their emitter.
    """

    responses: NDArray[np.float32]
    emitters: FloatArray
    listeners: FloatArray
    samples_a_metre: float
    offsets: FloatArray

    @classmethod
    def of(cls, rows: FitSet) -> "AlignedRows":
        """Keep the rows of a set."""
        rows = rows.spread(MOST_ROWS)
        return cls(
            rows.responses.astype(np.float32),
            rows.emitters.positions,
            rows.listeners.positions,
            rows.sample_rate / rows.speed_of_sound,
            aimed_offsets(rows.emitters, rows.listeners),
        )

    def predict(
        self,
        emitters: Poses,
        listeners: Poses,
        n_samples: int,
        *,
        aimed: bool = False,
    ) -> FloatArray:
        """Return interpolated responses, shape (queries, n_samples).

        Parameters
        ----------
        emitters, listeners : Poses
            The ends.
        n_samples : int
            Length of an answer.
        aimed : bool
            Take rows for near where the listener stands alike in the frame of the
            emitter. The answer then belongs to these devices in this order.
        """
        return self._answer(emitters, listeners, n_samples, aimed)

    def left_out(self, rows: FitSet, *, aimed: bool = False) -> FloatArray:
        """Return predictions for rows of this set by the other emitters' rows.

        With a single emitter place, by rows whose listener is elsewhere.
        """
        own, near = self.emitters, SAME_M
        unheard = rows.emitters.positions
        if rows.n_places < 2:
            own, near, unheard = self.listeners, APART_M, rows.listeners.positions
        hidden = squares(unheard, own) < near**2
        ends = rows.emitters, rows.listeners
        return self._answer(*ends, rows.n_samples, aimed, hidden)

    def _answer(
        self,
        emitters: Poses,
        listeners: Poses,
        n_samples: int,
        aimed: bool,
        hidden: NDArray[np.bool_] | None = None,
    ) -> FloatArray:
        out = np.zeros((len(emitters), n_samples))
        first, second = emitters.positions, listeners.positions
        reach = np.linalg.norm(first - second, axis=1)
        offsets = aimed_offsets(emitters, listeners)
        for start in range(0, len(first), CHUNK):
            part = slice(start, start + CHUNK)
            gaps = self._gaps(first[part], second[part])
            if aimed:
                gaps = squares(offsets[part], self.offsets) + FAINT * gaps
            if hidden is not None:
                gaps = np.where(hidden[part], FAR, gaps)
            out[part] = self._mixed(gaps, reach[part], n_samples)
        return out

    def _gaps(self, first: FloatArray, second: FloatArray) -> FloatArray:
        """Return squared distances to all rows, the nearer order of the ends."""
        there = squares(first, self.emitters) + squares(second, self.listeners)
        back = squares(first, self.listeners) + squares(second, self.emitters)
        return np.minimum(there, back)

    def _mixed(self, gaps: FloatArray, reach: FloatArray, n_samples: int) -> FloatArray:
        from scipy.fft import irfft, next_fast_len, rfft

        count = min(NEIGHBOURS, gaps.shape[1])
        rows = np.argpartition(gaps, count - 1, axis=1)[:, :count]
        near = np.take_along_axis(gaps, rows, axis=1)
        weights = np.where(near < FAR, 1 / (near + SAME_M**2), 0.0)
        weights /= np.maximum(weights.sum(axis=1, keepdims=True), 1e-300)
        stored = self._lengths[rows]
        shift = (reach[:, None] - stored) * self.samples_a_metre
        level = np.maximum(stored, NEAREST_M) / np.maximum(reach, NEAREST_M)[:, None]
        size = next_fast_len(2 * self.responses.shape[1], real=True) or 2
        spectra = np.asarray(rfft(self.responses[rows].astype(np.float64), size))
        turn = np.exp(-2j * np.pi / size * shift[..., None] * np.arange(size // 2 + 1))
        joined = np.einsum("qk,qkf->qf", weights * level, spectra * turn)
        waves = np.asarray(irfft(joined, size))[:, :n_samples]
        return np.pad(waves, ((0, 0), (0, n_samples - waves.shape[1])))

    @property
    def _lengths(self) -> FloatArray:
        return np.linalg.norm(self.emitters - self.listeners, axis=1)


def squares(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return squared distances, (places, 3) by (others, 3)."""
    return ((first[:, None] - second) ** 2).sum(axis=-1)
