"""How well waveforms agree with measured ones, by octave and time after the direct.

Where they agree they are kept; where they do not, late sound takes their place, and in
between both share the energy. Time counts from the direct sound: at one moment after
the emission some pairs hear their direct sound and others late echoes.
"""

from dataclasses import dataclass

import numpy as np

from inverse.late.gate import LEAST_ROWS, NULL_SIGMAS, TileEnergies
from inverse.rows.tiles import Tiles

__all__ = ["Agreement", "bins_after"]


@dataclass(frozen=True, eq=False)
class Agreement:
    """Hold coherences and what is made of them.

    Parameters
    ----------
    coherence : numpy.ndarray
        Squared, of told and measured waveforms, shape (kinds, bands, bins + 1):
        first for ends in one region, then for ends apart.
    levels : numpy.ndarray
        Measured over told amplitudes, the same shape.
    low, high : float
        Coherences under which no waveform is kept, and above which all of it.
    steady : bool
        Whether waveforms that are kept keep their own energies as well.
    late_gain : float
        Amplitude of late sound where no waveform is known, 1 for its energy.
    """

    coherence: np.ndarray
    levels: np.ndarray
    low: float = 0.2
    high: float = 0.6
    steady: bool = False
    late_gain: float = 1.0

    @classmethod
    def fit(
        cls, held: TileEnergies, after: np.ndarray, apart: np.ndarray
    ) -> "Agreement":
        """Compare waveforms tile by tile.

        Parameters
        ----------
        held : TileEnergies
            Energies and products of the same pairs.
        after : numpy.ndarray
            What `bins_after` says of them, shape (pairs, bins).
        apart : numpy.ndarray
            How little both ends share a region, shape (pairs,).
        """
        kinds = [apart < 0.5, apart >= 0.5]
        if min(int(one.sum()) for one in kinds) < LEAST_ROWS:
            kinds = [np.ones(len(apart), dtype=bool)]
        parts = [_compared(held, rows, after) for rows in kinds]
        coherence, levels = (np.stack(one) for one in zip(*parts, strict=True))
        return cls(coherence, levels)

    def as_arrays(self) -> dict[str, np.ndarray]:
        """Return everything as plain arrays, for a file."""
        return {name: np.asarray(one) for name, one in vars(self).items()}

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray]) -> "Agreement":
        """Rebuild what :meth:`as_arrays` returned."""
        parts = {name: one if one.ndim else one.item() for name, one in arrays.items()}
        parts["late_gain"] = parts.pop("calm", parts.get("late_gain", 1.0))  # once calm
        return cls(**parts)  # type: ignore

    def between(
        self, after: np.ndarray, apart: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return shares and levels of pairs, shape (pairs, bands, bins) each."""
        span = max(self.high - self.low, 1e-9)
        shares = np.clip((self.coherence - self.low) / span, 0.0, 1.0)
        far = np.clip(apart, 0, 1)[:, None, None]
        if len(shares) == 1:
            far = np.zeros_like(far)
        parts = []
        for one in (shares, self.levels):
            near, away = (
                kind[:, after].transpose(1, 0, 2) for kind in (one[0], one[-1])
            )
            parts.append(near + far * (away - near))
        return parts[0], parts[1]


def bins_after(
    distances: np.ndarray, speed_of_sound: float, tiles: Tiles
) -> np.ndarray:
    """Return how many bins each bin comes after the direct sound's, (pairs, bins).

    The direct sound's own is 1; all bins before it are 0.
    """
    arrival = (distances / speed_of_sound)[:, None]
    after = np.floor((tiles.times - arrival) / tiles.bin_s + 0.5).astype(int) + 1
    return np.clip(after, 0, tiles.bins)


def _compared(
    held: TileEnergies, rows: np.ndarray, after: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return coherences and level ratios of some pairs, (bands, bins + 1) each."""
    loud = held.measured[rows].sum(axis=(1, 2))
    # rows that are silent say nothing
    even = np.divide(1.0, loud, out=np.zeros_like(loud), where=loud > 1e-200)
    where = after[rows].ravel()
    kinds = held.measured, held.predicted, held.products, held.shuffled
    parts = [kind[rows] * even[:, None, None] for kind in kinds]
    measured, predicted, product = (_sums(one, where) for one in parts[:3])
    chance = _sums(parts[3] ** 2, where)
    # held against chance before it is divided: the quotient of silent tiles overflows
    sure = (product > 0) & (product**2 > NULL_SIGMAS**2 * chance)
    scale = np.maximum(measured * predicted, 1e-300)
    found = np.where(sure, product**2, 0.0) / scale
    levels = np.sqrt(measured / np.maximum(predicted, 1e-6 * measured + 1e-300))
    return np.minimum(found, 1.0), levels


def _sums(values: np.ndarray, where: np.ndarray) -> np.ndarray:
    """Return sums over pairs of what lies equally long after the direct sound."""
    size, bands = values.shape[2] + 1, values.swapaxes(0, 1)
    return np.stack([np.bincount(where, one.ravel(), size) for one in bands])
