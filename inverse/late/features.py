"""Smooth functions of a place, broken where regions meet."""

from dataclasses import dataclass

import numpy as np

from inverse.rows.regions import Regions

__all__ = ["PlaceFeatures"]

SPACING_M = 1.0  # levels of one room change over a metre and more (decision 0058)
MOST = 60  # bumps; larger spaces get wider ones: steps cost the cube of their number
NEAR = 1.0  # spacings: bumps farther from all places are known from none


@dataclass(frozen=True, eq=False)
class PlaceFeatures:
    """Turn places into bumps on a grid and shares of regions."""

    centers: np.ndarray
    """Middles of the bumps, shape (bumps, 3), metres."""
    spacing: float
    """Distance of neighbouring bumps, and their width, metres."""
    regions: Regions
    """Which region a place lies in."""

    @classmethod
    def of(cls, places: np.ndarray, regions: Regions) -> "PlaceFeatures":
        """Lay a grid over places, shape (places, 3); keep bumps near any."""
        spacing = SPACING_M
        centers = _grid(places, spacing)
        while len(centers) > MOST:
            spacing *= 1.25
            centers = _grid(places, spacing)
        return cls(centers, spacing, regions)

    def __call__(self, positions: np.ndarray) -> np.ndarray:
        """Return features, shape (places, bumps + regions)."""
        gap = positions[:, None] - self.centers
        bumps = np.exp(-0.5 * (gap**2).sum(axis=-1) / self.spacing**2)
        return np.hstack([bumps, self.regions(positions)])


def _grid(places: np.ndarray, spacing: float) -> np.ndarray:
    low, high = places.min(axis=0), places.max(axis=0)
    counts = np.floor((high - low) / spacing).astype(int) + 1
    middle = 0.5 * (low + high)
    axes = [
        middle[k] + spacing * (np.arange(counts[k]) - 0.5 * (counts[k] - 1))
        for k in range(3)
    ]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    if len(nodes) > 50 * MOST:
        return nodes
    gap = np.linalg.norm(nodes[:, None] - places, axis=-1).min(axis=1)
    kept = nodes[gap <= NEAR * spacing]
    return kept if len(kept) else nodes[:1]
