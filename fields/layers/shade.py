"""How much of the straight sound gets through: a learned volume of obstacles."""

import numpy as np
import torch
from torch import Tensor, nn

from fields.layers.query import Query

__all__ = ["Shade"]

CELLS = 24  # a side: 0.2 m in a room of 5 m, the size of furniture
POINTS = 48  # on a straight way: two a cell
OPAQUE = 3.0  # nepers a metre and unit: a metre at softplus 1 dims by 26 dB
START = -5.5  # softplus 0.004: nothing is dimmed before anything is learned
# Adam moves a weight by 1e-3 a step at most; walls must rise within a training.
PACE = 20.0


class Shade(nn.Module):
    """Integrate a learned opacity along the segment between the ends.

    The same for both directions, so a field that is reciprocal stays so.

    Parameters
    ----------
    low, high : numpy.ndarray
        Corners of the box the ends are in, shape (3,), metres.
    """

    def __init__(self, low: np.ndarray, high: np.ndarray) -> None:
        super().__init__()
        middle = 0.5 * (low + high)
        extent = np.maximum(0.5 * (high - low), 0.1)
        self.register_buffer("middle", torch.tensor(middle, dtype=torch.float32))
        self.register_buffer("extent", torch.tensor(extent, dtype=torch.float32))
        self.opacity = nn.Parameter(torch.zeros(1, 1, CELLS, CELLS, CELLS))
        shares = (torch.arange(POINTS) + 0.5) / POINTS
        self.register_buffer("shares", shares, persistent=False)

    middle: Tensor
    extent: Tensor
    shares: Tensor

    def forward(self, query: Query) -> Tensor:
        """Return the share of amplitude that gets through, shape (batch,)."""
        offset = query.listener - query.emitter
        places = query.emitter[:, None] + offset[:, None] * self.shares[:, None]
        local = ((places - self.middle) / self.extent)[None, :, :, None]
        read = nn.functional.grid_sample(
            self.opacity, local, padding_mode="border", align_corners=True
        )
        density = OPAQUE * nn.functional.softplus(PACE * read + START)
        return torch.exp(-density.mean((0, 1, 3, 4)) * query.distance)
