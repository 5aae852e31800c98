"""Learned features on a regular grid of points, read by Gaussian kernels."""

import numpy as np
import torch
from torch import Tensor, nn

__all__ = ["FeatureGrid"]

# Both for points 0.25 m apart, as in NAF; they grow with the spacing.
OFFSET_M = 0.1  # how far a point may wander
WIDTH_M = (0.1, 0.5)  # least and greatest width of its kernel


class FeatureGrid(nn.Module):
    """Interpolate features between points that may wander a little.

    Parameters
    ----------
    low, high : numpy.ndarray
        Corners of the box, shape (3,), metres.
    spacing : float
        Distance of the points, metres; grown until at most ``most`` are left.
    features : int
        Values a point holds.
    most : int
        Largest number of points.
    """

    def __init__(
        self,
        low: np.ndarray,
        high: np.ndarray,
        spacing: float,
        features: int,
        most: int = 1000,
    ) -> None:
        super().__init__()
        points, spacing = _grid_points(low, high, spacing, most)
        self.register_buffer("points", torch.as_tensor(points, dtype=torch.float32))
        self.register_buffer("spacing", torch.tensor(float(spacing)))
        self.values = nn.Parameter(torch.randn(len(points), features) / features**0.5)
        self.offsets = nn.Parameter(torch.zeros(len(points), 3))
        self.widths = nn.Parameter(torch.zeros(len(points)))

    points: Tensor
    spacing: Tensor

    def forward(self, positions: Tensor) -> Tensor:
        """Read features at positions of shape (batch, 3), metres."""
        grown = self.spacing / 0.25
        centers = self.points + OFFSET_M * grown * torch.tanh(self.offsets)
        low, high = WIDTH_M
        width = grown * (low + (high - low) * torch.sigmoid(self.widths - 0.5))
        squares = torch.cdist(positions, centers).square()
        # A softmax cannot divide nought by nought far from every point.
        weights = torch.softmax(-0.5 * squares / width.square(), dim=-1)
        return weights @ self.values


def _grid_points(
    low: np.ndarray, high: np.ndarray, spacing: float, most: int
) -> tuple[np.ndarray, float]:
    while True:
        counts = np.maximum(np.ceil((high - low) / spacing).astype(int) + 1, 1)
        if counts.prod() <= most:
            break
        spacing *= 1.1
    axes = [
        np.linspace(a, b, n) if n > 1 else np.array([0.5 * (a + b)])
        for a, b, n in zip(low, high, counts, strict=True)
    ]
    mesh = np.meshgrid(*axes, indexing="ij")
    return np.stack([axis.ravel() for axis in mesh], axis=1), spacing
