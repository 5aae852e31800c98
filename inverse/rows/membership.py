"""Shares of regions by mean-field steps over who sees whom."""

import numpy as np

__all__ = ["settle", "spectral_start"]

STEPS = 40  # of the mean field: shares stand still after some twenty
NEIGHBOURS = 8  # places beside each: as in a plane, those around it
PULL = 1.0  # neighbours together weigh as much as one pair of whom it is certain
WRONG = 0.03  # part of sights misread, by furniture and faint sound: no pair is surer
MOST_SPECTRAL = 600
"""Places of a dense decomposition, half a second; more are taken sparse."""


def _neighbours(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the nearest places of each and weights that add up to one."""
    from scipy.spatial import KDTree

    most = min(NEIGHBOURS + 1, len(places))
    found = KDTree(places).query(places, k=most)
    gaps, near = np.asarray(found[0])[:, 1:], np.asarray(found[1])[:, 1:]
    scale = max(float(np.median(gaps)), 1e-3)
    weight = np.exp(-0.5 * (gaps / scale) ** 2) + 1e-3
    return near, weight / weight.sum(axis=1, keepdims=True)


def spectral_start(
    places: np.ndarray, pairs: np.ndarray, seen: np.ndarray, count: int
) -> np.ndarray:
    """Return shares, shape (places, count), from the signed graph of sight.

    Places are joined to their neighbours and to what they see, and pushed from
    what they do not see; the lowest modes of that graph part the groups.
    """
    near, weight = _neighbours(places)
    size = len(places)
    graph = np.zeros((size, size))
    rows = np.repeat(np.arange(size), near.shape[1])
    np.add.at(graph, (rows, near.ravel()), 0.5 * weight.ravel())
    sign = np.where(seen > 0, 1.0, -1.0)
    degree = np.bincount(pairs.ravel(), minlength=size).clip(1)
    strength = sign / np.sqrt(degree[pairs[0]] * degree[pairs[1]])
    np.add.at(graph, (pairs[0], pairs[1]), strength)
    graph = graph + graph.T
    scale = 1 / np.sqrt(np.abs(graph).sum(axis=1).clip(1e-12))
    modes = _top_modes(scale[:, None] * graph * scale, count)
    return _grouped(modes, count)


def _top_modes(matrix: np.ndarray, count: int) -> np.ndarray:
    from scipy.sparse.linalg import eigsh

    if len(matrix) <= MOST_SPECTRAL:
        return np.linalg.eigh(matrix)[1][:, -count:]
    start = np.linspace(0.5, 1.0, len(matrix))
    return eigsh(matrix, k=count, which="LA", v0=start)[1]


def _grouped(modes: np.ndarray, count: int) -> np.ndarray:
    """Divide rows into groups: farthest points first, then Lloyd's steps."""
    chosen = [int(np.argmax((modes**2).sum(axis=1)))]
    for _ in range(count - 1):
        gap = ((modes[:, None] - modes[chosen]) ** 2).sum(axis=-1).min(axis=1)
        chosen.append(int(np.argmax(gap)))
    middles = modes[chosen]
    numbers = np.zeros(len(modes), dtype=int)
    for _ in range(20):
        numbers = ((modes[:, None] - middles) ** 2).sum(axis=-1).argmin(axis=1)
        for group in range(count):
            if (numbers == group).any():
                middles[group] = modes[numbers == group].mean(axis=0)
    return 0.8 * np.eye(count)[numbers] + 0.2 / count


def settle(
    places: np.ndarray, pairs: np.ndarray, seen: np.ndarray, shares: np.ndarray
) -> tuple[np.ndarray, float]:
    """Return shares after mean-field steps, and the log likelihood of the sights."""
    near, weight = _neighbours(places)
    first, second = pairs
    # Two ends of one pair may be one place.
    apart = first != second
    first, second, seen = first[apart], second[apart], seen[apart]
    within, across = 0.9, 0.1
    for _ in range(STEPS):
        same = np.log(np.where(seen > 0, within, 1 - within))
        other = np.log(np.where(seen > 0, across, 1 - across))
        lean = (same - other)[:, None]
        field = np.zeros_like(shares)
        np.add.at(field, first, lean * shares[second])
        np.add.at(field, second, lean * shares[first])
        field += 2 * PULL * np.einsum("nk,nkr->nr", weight, shares[near])
        field -= field.max(axis=1, keepdims=True)
        new = np.exp(field)
        new /= new.sum(axis=1, keepdims=True)
        shares = 0.5 * (shares + new)
        together = (shares[first] * shares[second]).sum(axis=1)
        within = _share(together, seen, 0.6)
        across = min(_share(1 - together, seen, 0.05), within - 0.1)
    hard = shares.argmax(axis=1)
    joint = hard[first] == hard[second]
    chance = np.where(joint, within, across)
    score = np.log(np.where(seen > 0, chance, 1 - chance)).sum()
    # Ragged regions could explain any bits: borders have to be paid for.
    score -= 2 * PULL * (weight * (hard[near] != hard[:, None])).sum()
    return shares, float(score)


def _share(weights: np.ndarray, seen: np.ndarray, prior: float) -> float:
    share = (weights @ seen + 4 * prior) / (weights.sum() + 4)
    return float(np.clip(share, WRONG, 1 - WRONG))
