"""Energy of any pair in every tile: common slopes, corrected near the direct sound.

Late bins follow the common slopes of `inverse.late.late_maps`. Before those hold,
what is left is regressed, bin by bin after the direct sound, on distance and on
whether the ends share a region; every regressor is the same from both sides.
"""

from dataclasses import dataclass

import numpy as np

from inverse.late.features import PlaceFeatures
from inverse.late.late_maps import LateMaps, chi_square_bias, fit_maps
from inverse.late.slopes import common_rates, region_curves
from inverse.rows.regions import apartness
from inverse.rows.tiles import SILENT, Tiles

__all__ = ["EnergyModel", "arrival_shares"]

KNOTS_S = np.array([0.0, 0.003, 0.007, 0.013, 0.025, 0.05, 0.1])
"""After the direct sound, each about twice the one before: early energy changes by the
ratio of times, not by their difference."""
MIXED_S = 0.02  # after the direct sound: single reflections no longer rule the slopes
LONG_TAIL_S = 0.15  # a shorter tail tells no second rate (decision 0058)
PROFILE_RIDGE = 8.0  # as much as eight bins that ask for no correction
LEAST_LATE_BINS = 5  # a pair: with fewer, early bins have to tell the slope as well
NEAREST_M = 0.1  # ends closer than devices are large count as that far apart


@dataclass(frozen=True, eq=False)
class EnergyModel:
    """Hold the energy model of all octaves."""

    maps: tuple[LateMaps, ...]
    """One an octave."""
    profiles: np.ndarray
    """Weights of the corrections, shape (bands, regressors)."""
    features: PlaceFeatures
    """Of a place."""
    speed_of_sound: float
    """Metres per second."""

    def __call__(
        self, first: np.ndarray, second: np.ndarray, tiles: Tiles
    ) -> np.ndarray:
        """Return log energies of the tiles, shape (pairs, bands, bins), neper.

        Minus infinity before the direct sound.
        """
        ends = self.features(first), self.features(second)
        distances = np.linalg.norm(first - second, axis=1)
        shares = arrival_shares(distances, self.speed_of_sound, tiles)
        profile = _regressors(distances, _apart(self.features, ends), shares[1])
        out = np.empty((len(first), len(self.maps), tiles.bins))
        for band, maps in enumerate(self.maps):
            out[:, band] = maps.log_energies(*ends, tiles.times)
            out[:, band] += profile @ self.profiles[band]
        with np.errstate(divide="ignore"):
            return out + np.log(shares[0])[:, None]

    @classmethod
    def fit(
        cls,
        energies: np.ndarray,
        first: np.ndarray,
        second: np.ndarray,
        tiles: Tiles,
        features: PlaceFeatures,
        speed_of_sound: float,
    ) -> "EnergyModel":
        """Fit measured energies of tiles, shape (pairs, bands, bins)."""
        ends = features(first), features(second)
        distances = np.linalg.norm(first - second, axis=1)
        shares, after = arrival_shares(distances, speed_of_sound, tiles)
        whole = shares > 0.99
        profile = _regressors(distances, _apart(features, ends), after)
        numbers = features.regions.numbers(first), features.regions.numbers(second)
        maps, weights = [], []
        widths = tiles.widths
        for band in range(len(tiles.centers)):
            log = _corrected(energies[:, band], widths[band], tiles.bin_s, whole)
            late = _late_bins(log, after)
            fitted = _fit_band(log, late, tiles, ends, numbers, features)
            gap = log - fitted.log_energies(*ends, tiles.times)
            maps.append(fitted)
            weights.append(_regressed(profile, gap))
        return cls(tuple(maps), np.array(weights), features, speed_of_sound)


def arrival_shares(
    distances: np.ndarray, speed_of_sound: float, tiles: Tiles
) -> tuple[np.ndarray, np.ndarray]:
    """Return the part of each bin after the direct sound, and how long after.

    Both of shape (pairs, bins); the second in seconds, not below 0.
    """
    arrival = (distances / speed_of_sound)[:, None]
    ends = (np.arange(tiles.bins) + 1) * tiles.bin_s
    share = np.clip((ends - arrival) / tiles.bin_s, 0.0, 1.0)
    return share, np.maximum(tiles.times - arrival, 0.0)


def _apart(features: PlaceFeatures, ends: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Return how little two ends share a region, 0 to 1."""
    count = features.regions.count
    first, second = (one[:, one.shape[1] - count :] for one in ends)
    return apartness(first, second)


def _regressors(
    distances: np.ndarray, apart: np.ndarray, after: np.ndarray
) -> np.ndarray:
    """Return hats over the time after the direct sound, times what may matter."""
    hats = np.stack([np.interp(after, KNOTS_S, one) for one in np.eye(len(KNOTS_S))])
    near = np.log(np.maximum(distances, NEAREST_M))
    kinds = np.stack([np.ones_like(near), near, apart])
    # The last hat stands for late sound, which the slopes tell alone.
    products = np.einsum("hnt,kn->nthk", hats[:-1], kinds)
    return products.reshape(*after.shape, -1)


def _corrected(
    energies: np.ndarray, width: float, bin_s: float, whole: np.ndarray
) -> np.ndarray:
    """Return log energies, NaN where a bin is cut or silent."""
    loudest = float(energies.max(initial=0.0))
    audible = whole & (energies > SILENT * loudest)
    log = np.full(energies.shape, np.nan)
    bias = chi_square_bias(width, bin_s)
    np.log(energies, out=log, where=audible)
    return log - bias


def _late_bins(log: np.ndarray, after: np.ndarray) -> np.ndarray:
    known = np.isfinite(log)
    late = known & (after >= MIXED_S)
    return late if late.sum() >= LEAST_LATE_BINS * max(len(log), 1) else known


def _fit_band(
    log: np.ndarray,
    late: np.ndarray,
    tiles: Tiles,
    ends: tuple[np.ndarray, np.ndarray],
    numbers: tuple[np.ndarray, np.ndarray],
    features: PlaceFeatures,
) -> LateMaps:
    rates = _rates(log, late, tiles.times, numbers)
    masked = np.where(late, log, np.nan)
    count = features.regions.count
    return fit_maps(masked, tiles.times, *ends, rates, flags=count)


def _rates(
    log: np.ndarray,
    late: np.ndarray,
    times: np.ndarray,
    numbers: tuple[np.ndarray, np.ndarray],
) -> np.ndarray:
    """Return pooled rates over the bins that nearly all pairs know."""
    if not late.any():
        return np.array([13.8])
    common = late.mean(axis=0) > 0.9
    rows = late[:, common].all(axis=1)
    if common.sum() < 2 or not rows.any():
        return np.array([13.8])
    held = len(np.unique(numbers[0]))
    # A short tail holds no second rate; what looks like one is early sound.
    span = float(np.ptp(times[common]))
    most = min(held, 2) if span > LONG_TAIL_S else 1
    curves = region_curves(
        np.exp(log[np.ix_(rows, common)]), numbers[0][rows], numbers[1][rows]
    )
    return common_rates(curves, times[common], most=most)


def _regressed(profile: np.ndarray, gap: np.ndarray) -> np.ndarray:
    known = np.isfinite(gap)
    rows, values = profile[known], gap[known]
    normal = rows.T @ rows
    normal[np.diag_indices_from(normal)] += PROFILE_RIDGE
    return np.linalg.solve(normal, rows.T @ values)
