"""The points of a batch that a volume is asked about."""

from dataclasses import dataclass

from torch import Tensor

__all__ = ["Points"]


@dataclass(frozen=True, eq=False)
class Points:
    """Hold the points of a batch that the network is asked about."""

    positions: Tensor
    """Shape (batch, rays, points, 3), metres."""
    shells: Tensor
    """Shell of each point, shape (batch, rays, points), int64."""
    weights: Tensor
    """Share of each point without any pattern, shape (batch, rays, points)."""
    rays: Tensor
    """Unit vectors away from the listener, shape (rays, 3), room frame."""

    def __getitem__(self, rows: slice) -> "Points":
        shells, weights = self.shells[rows], self.weights[rows]
        return Points(self.positions[rows], shells, weights, self.rays)
