"""Rooms as groups of places that see each other, found without any wall.

Each measured pair says whether its direct sound arrived. Places that share a
region should see each other, places apart should not, and neighbours mostly
belong together. Shares of regions follow by mean-field steps from a spectral
start, for one region and more; each further region has to earn its place.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from inverse.rows.fitset import SAME_PLACE_M
from inverse.rows.membership import settle, spectral_start
from inverse.rows.partition import split_by_planes

__all__ = ["Regions", "apartness", "direct_levels", "find_regions", "sight_bits"]

MOST_REGIONS = 4
"""Rooms that one session spans; more need emitters of their own that few have."""
LENGTH_M = 1.5  # over which places share a region: half a small room
DOUBT = 1.0  # noise over signal of one place's region: three neighbours outvote it
SHARPNESS = 40.0
"""Of the border between regions: nine tenths to one within decimetres (0065)."""
LEAST_HIDDEN = 0.08  # of pairs: fewer are hidden by furniture or read wrong
GAIN_PER_BIT, GAIN_PER_PLANE = 0.1, 0.05
"""Neper a pair that one more region must bring: less where it is a plane, which has two
numbers, than where places may be given one by one."""
SEEN = 0.63
"""Of the free level, -4 dB: a direct sound that pattern and pose errors dimmed."""
HIDDEN = 0.4
"""-8 dB: only something in the way dims so much; between both nothing is said."""
SLACK_SAMPLES = 2
"""A direct sound stands so near its delay, poses of millimetres allowed for."""


def apartness(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return how little two ends share a region, 0 to 1, shape (pairs,).

    Parameters
    ----------
    first, second : numpy.ndarray
        Shares of regions of each end, shape (pairs, regions).

    Examples
    --------
    >>> apartness(np.eye(2), np.array([[1.0, 0.0], [0.5, 0.5]])).tolist()
    [0.0, 0.5]
    """
    return 1 - (first * second).sum(axis=1)


@dataclass(frozen=True, eq=False)
class Regions:
    """Hold how far each place belongs to each region (room)."""

    places: np.ndarray
    """Known places, shape (places, 3), metres."""
    shares: np.ndarray
    """Their shares, shape (places, regions); each row adds up to one."""

    @classmethod
    def one(cls) -> "Regions":
        """Return the whole space as one region."""
        return cls(np.zeros((1, 3)), np.ones((1, 1)))

    @property
    def count(self) -> int:
        """Number of regions."""
        return self.shares.shape[1]

    def __call__(self, positions: np.ndarray) -> np.ndarray:
        """Return shares of regions, shape (places, regions)."""
        if len(self.places) == 1:
            return np.repeat(self.shares, len(positions), axis=0)
        bump = _closeness(positions, self.places)
        leaning = self.shares.mean(axis=0) + bump @ self._pulls
        held = np.exp(SHARPNESS * (leaning - leaning.max(axis=1, keepdims=True)))
        return held / held.sum(axis=1, keepdims=True)

    @cached_property
    def _pulls(self) -> np.ndarray:
        # Regression that trusts no single place keeps the border between regions
        # straight where a few places were given to the wrong one.
        close = _closeness(self.places, self.places)
        close[np.diag_indices_from(close)] += DOUBT
        return np.linalg.solve(close, self.shares - self.shares.mean(axis=0))

    def numbers(self, positions: np.ndarray) -> np.ndarray:
        """Return the region each place belongs to most, shape (places,)."""
        return np.argmax(self(positions), axis=1)


def sight_bits(
    responses: np.ndarray,
    distances: np.ndarray,
    sample_rate: float,
    speed_of_sound: float,
    gains: np.ndarray | None = None,
) -> np.ndarray:
    """Return 1 where the direct sound arrived, 0 where it did not, NaN in doubt.

    Parameters
    ----------
    responses : numpy.ndarray
        Shape (pairs, n_samples), direct sound about 1/distance.
    distances : numpy.ndarray
        Between the ends, shape (pairs,), metres.
    sample_rate, speed_of_sound : float
        Hertz, metres per second.
    gains : numpy.ndarray, optional
        Levels expected of free direct sounds, up to a common factor, shape
        (pairs,). Pairs below a quarter of the loud ones stay in doubt.
    """
    level = direct_levels(responses, distances, sample_rate, speed_of_sound)
    pattern = np.ones(len(level))
    if gains is not None:
        pattern = np.abs(gains) / max(
            float(np.nanquantile(np.abs(gains), 0.75)), 1e-300
        )
    level = level / np.maximum(pattern, 0.25)
    bits = np.full(len(level), np.nan)
    heard = np.isfinite(level) & (pattern >= 0.25)
    if not heard.any() or not level[heard].any():
        return bits
    # Direct sounds cannot be louder than free ones: the upper part is seen.
    free = float(np.quantile(level[heard], 0.75))
    bits[heard & (level > SEEN * free)] = 1.0
    bits[heard & (level < HIDDEN * free)] = 0.0
    return bits


def direct_levels(
    responses: np.ndarray,
    distances: np.ndarray,
    sample_rate: float,
    speed_of_sound: float,
) -> np.ndarray:
    """Return direct sounds' peaks times distance, shape (pairs,).

    NaN where the direct sound would arrive after the end.
    """
    count, n_samples = responses.shape
    delay = distances / speed_of_sound * sample_rate
    reach = np.arange(-SLACK_SAMPLES, SLACK_SAMPLES + 1)
    columns = np.rint(delay).astype(int)[:, None] + reach
    inside = (columns >= 0) & (columns < n_samples)
    picked = responses[np.arange(count)[:, None], np.clip(columns, 0, n_samples - 1)]
    level = np.abs(np.where(inside, picked, 0.0)).max(axis=1) * distances
    return np.where(inside.any(axis=1), level, np.nan)


def find_regions(
    emitters: np.ndarray, listeners: np.ndarray, bits: np.ndarray
) -> Regions:
    """Return the regions that explain which pairs of places see each other.

    Parameters
    ----------
    emitters, listeners : numpy.ndarray
        Ends of each pair, shape (pairs, 3), metres.
    bits : numpy.ndarray
        1 seen, 0 hidden, NaN in doubt, shape (pairs,).

    Notes
    -----
    A region is only believed where at least two emitters stand, or more than one
    place on either side: from two emitters in all, a third of the places may be
    given to the wrong one.
    """
    known = np.isfinite(bits)
    if known.sum() < 8 or (bits[known] == 0).mean() < LEAST_HIDDEN:
        return Regions.one()
    ends = np.vstack([emitters[known], listeners[known]])
    rounded = np.round(ends / SAME_PLACE_M).astype(np.int64)
    _, first, numbers = np.unique(
        rounded, axis=0, return_index=True, return_inverse=True
    )
    places = ends[first]
    half = int(known.sum())
    pairs = np.stack([numbers.ravel()[:half], numbers.ravel()[half:]])
    seen = bits[known]
    best, best_score = np.ones((len(places), 1)), _score_of_one(seen)
    for count in range(2, min(MOST_REGIONS, len(places)) + 1):
        start = spectral_start(places, pairs, seen, count)
        shares, score = settle(places, pairs, seen, start)
        parted, parted_score = split_by_planes(places, pairs, seen, best.argmax(axis=1))
        gain = GAIN_PER_BIT
        if parted_score > score:
            gain = GAIN_PER_PLANE
            _, groups = np.unique(parted, return_inverse=True)
            shares, score = np.eye(count)[groups.reshape(-1)], parted_score
        if score < best_score + gain * len(seen):
            break
        best, best_score = shares, score
    if best.shape[1] == 1:
        return Regions.one()
    return Regions(places, best)


def _closeness(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    square = (first**2).sum(axis=1)[:, None] + (second**2).sum(axis=1)
    square -= 2 * first @ second.T
    return np.exp(-0.5 * np.maximum(square, 0) / LENGTH_M**2)


def _score_of_one(seen: np.ndarray) -> float:
    share = float(np.clip(seen.mean(), 0.01, 0.99))
    return float(np.log(np.where(seen > 0, share, 1 - share)).sum())
