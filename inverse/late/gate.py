"""How far paths are trusted, tile by tile, and their gains.

In each octave, bin and pair of regions the paths' waveforms are held against the
measured ones. Where they agree they are kept; where their waveform fails but their
energy is still the best guess it is corrected; elsewhere the energy model speaks.
"""

from dataclasses import dataclass, replace

import numpy as np

from inverse.rows.tiles import SILENT

__all__ = ["Gate", "TileEnergies", "judge"]

EXPLAINED = 10 ** (-25 / 10)  # of a tile's energy: paths so right stay (0059)
TRUSTED, LOST = 0.7, 0.3
"""Of the coherence that poses and air allow: above, waveforms are kept; below, they are
not; in between, energies decide."""
NULL_SIGMAS = 3.0  # coherence of shuffled pairs that is still chance
MOST_GAIN = 2.0  # 6 dB: paths that need more are not the ones that were measured
LEAST_ROWS = 8  # pairs of a kind (one region, or apart) that are judged by themselves
LEAST_SURE = 0.1  # of later tiles; where fewer agree, energies do by chance (0059)
UNKNOWN = 1e9  # squared error, neper squared, where nothing can be compared
LEAST_BEYOND = 0.03  # of an error that stays: chance is known no better


@dataclass(frozen=True, eq=False)
class TileEnergies:
    """Hold measured energies of tiles, those of paths, and products of both.

    `shuffled` are products with another pair's paths. Each of shape (pairs, bands,
    bins).
    """

    measured: np.ndarray
    predicted: np.ndarray
    products: np.ndarray
    shuffled: np.ndarray


@dataclass(frozen=True, eq=False)
class Gate:
    """Say what is made of the paths in each tile."""

    gains: np.ndarray
    """Amplitude gain of the paths, shape (kinds, bands, bins): first for ends in one
    region, then for ends apart."""
    shares: np.ndarray
    """How much of the tile's energy the paths bring, 0 to 1; the tail brings the rest.
    Same shape."""
    weights: np.ndarray
    """How much the paths' energy is believed beside the energy model's, 0 to 1; 1 where
    nothing is to be changed but the gain. Same shape."""
    coherence: np.ndarray
    """As measured, same shape."""
    trims: np.ndarray
    """Amplitude gain of the whole answer, so that each tile's energy is right on
    average; 1 where nothing but the paths speaks. Same shape."""

    def between(self, apart: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return gains, shares, weights and trims of pairs: (pairs, bands, bins).

        `apart`, shape (pairs,), is how little both ends share a region.
        """
        if len(self.gains) == 1:
            apart = np.zeros_like(apart)
        far = np.clip(apart, 0, 1)[:, None, None]
        parts = self.gains, self.shares, self.weights, self.trims
        return tuple(one[0] + far * (one[-1] - one[0]) for one in parts)

    def trimmed(
        self, measured: np.ndarray, predicted: np.ndarray, apart: np.ndarray
    ) -> "Gate":
        """Return the gate with the mean energy of each tile put right.

        `measured` and `predicted` are energies of the same pairs, (pairs, bands, bins);
        each pair counts the same.
        """
        loud = measured.sum(axis=(1, 2), keepdims=True)
        even = 1 / np.maximum(loud, 1e-12 * loud.max(initial=0.0) + 1e-300)
        trims = np.ones_like(self.trims)
        for kind in range(len(trims)):
            rows = np.ones(len(apart), dtype=bool)
            if len(trims) > 1:
                rows = (apart < 0.5) == (kind == 0)
            wanted = (measured[rows] * even[rows]).sum(axis=0)
            found = (predicted[rows] * even[rows]).sum(axis=0)
            ratio = wanted / np.maximum(found, 1e-6 * wanted + 1e-300)
            trims[kind] = np.clip(np.sqrt(ratio), 1 / MOST_GAIN, MOST_GAIN)
        open_tiles = (self.weights < 1) | (self.shares < 1)
        return replace(self, trims=np.where(open_tiles, trims, 1.0))

    @property
    def off(self) -> float:
        """Share of tiles in which the paths say nothing."""
        return float((self.shares < 0.5).mean())


def judge(
    held: TileEnergies,
    expected: np.ndarray,
    ratio: np.ndarray,
    model_misfit: np.ndarray,
    apart: np.ndarray,
    own: np.ndarray | float = 0.0,
) -> Gate:
    """Compare paths with measurements.

    Parameters
    ----------
    held : TileEnergies
        Energies and products.
    expected : numpy.ndarray
        Coherence that positions and temperature allow, shape (bands, bins).
    ratio, model_misfit : numpy.ndarray
        Log of the measured energies over the paths', and over what the energy
        model says of unseen emitters, shape (pairs, bands, bins); NaN if unknown.
    apart : numpy.ndarray
        How little both ends share a region, shape (pairs,).
    own : numpy.ndarray or float
        Variance of a measured tile's log energy that nothing can tell, shape
        (bands, 1). It is in both errors and no reason to believe either.
    """
    kinds = [apart < 0.5, apart >= 0.5]
    if min(int(one.sum()) for one in kinds) < LEAST_ROWS:
        kinds = [np.ones(len(apart), dtype=bool)]
    misfits = ratio, model_misfit, np.asarray(own)
    parts = [_judged(held, rows, expected, *misfits) for rows in kinds]
    return Gate(*(np.stack(one) for one in zip(*parts, strict=True)))


def _judged(
    held: TileEnergies,
    rows: np.ndarray,
    expected: np.ndarray,
    ratio: np.ndarray,
    model_misfit: np.ndarray,
    own: np.ndarray,
) -> tuple[np.ndarray, ...]:
    measured, predicted = held.measured[rows].sum(0), held.predicted[rows].sum(0)
    product = held.products[rows].sum(0)
    scale = np.maximum(measured * predicted, 1e-300)
    coherence = np.where(product > 0, product**2, 0.0) / scale
    chance = NULL_SIGMAS**2 * _spread(held.shuffled[rows]) / scale
    unexplained = measured + predicted - 2 * product
    # What was never there on either side is explained as well.
    floor = SILENT * max(float(measured.max(initial=0.0)), 1e-300)
    explained = unexplained <= EXPLAINED * measured + floor
    least = np.maximum(predicted, 1e-12 * measured + 1e-300)
    gain = np.sqrt(measured / least)
    trusted = (coherence > TRUSTED * expected) & (coherence > chance)
    lost = (coherence < LOST * expected) | (coherence < chance)
    sure = explained | (trusted & ~lost)
    path_error = _mean_square(ratio[rows] - _mean(ratio[rows]))
    model_error = _mean_square(model_misfit[rows])
    better = path_error < model_error
    # Paths that agree hardly anywhere are no better for their energy by chance.
    late = min(-(-3 * sure.shape[1] // 10), sure.shape[1] - 1)
    better &= sure[:, late:].mean() >= LEAST_SURE
    share = np.where(sure | better, 1.0, 0.0)
    starved = predicted * MOST_GAIN**2 < 0.25 * measured
    share = np.where(starved & ~explained, 0.0, share)
    # Loud pairs would speak for all where waveforms fail: take the mean in dB.
    gain = np.where(sure, gain, np.exp(0.5 * _mean(ratio[rows])))
    gain = np.where(explained, 1.0, np.clip(gain, 0.0, MOST_GAIN))
    errors = [_beyond(one, own) for one in (path_error, model_error)]
    weight = np.clip(errors[1] / np.maximum(sum(errors), 1e-300), 0.0, 1.0)
    weight = np.where(explained, 1.0, np.where(starved, 0.0, weight))
    return gain, share, weight, coherence, np.ones_like(gain)


def _beyond(error: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Return the part of a squared error that is not the tile's own chance."""
    return np.maximum(error - own, LEAST_BEYOND * error)


def _spread(products: np.ndarray) -> np.ndarray:
    """Return the variance of a sum of products that mean nothing."""
    return (products**2).sum(axis=0)


def _mean(values: np.ndarray) -> np.ndarray:
    known = np.isfinite(values)
    count = np.maximum(known.sum(axis=0), 1)
    return np.where(known, values, 0.0).sum(axis=0) / count


def _mean_square(misfit: np.ndarray) -> np.ndarray:
    """Return the mean square over pairs, very large where nothing is known."""
    known = np.isfinite(misfit)
    square = _mean(np.where(known, misfit, np.nan) ** 2)
    return np.where(known.any(axis=0), square, UNKNOWN)
