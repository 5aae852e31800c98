"""Multi-resolution hash grid with a compiled forward and backward on the CPU."""

from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

__all__ = ["HashGrid"]

PRIMES = (1, 2_654_435_761, 805_459_861)
"""Of the hash of Mueller et al., Instant Neural Graphics Primitives, 2022, eq. 4."""
CORNERS = tuple((a, b, c) for a in (0, 1) for b in (0, 1) for c in (0, 1))


class HashGrid(nn.Module):
    """Learned features at many resolutions, found by hashing the corner's number.

    Parameters
    ----------
    levels : int
        Number of resolutions; each is ``growth`` times finer than the last.
    features : int
        Values a corner holds.
    table_bits : int
        Logarithm of the entries a level holds.
    base : int
        Cells along the box at the coarsest level.
    growth : float
        Ratio of neighbouring resolutions.

    Notes
    -----
    Positions lie in [-1, 1]; no gradient flows to them.
    """

    def __init__(
        self,
        levels: int,
        features: int = 2,
        table_bits: int = 16,
        base: int = 8,
        growth: float = 1.4,
    ) -> None:
        super().__init__()
        resolutions = [int(base * growth**level) for level in range(levels)]
        self.register_buffer("resolutions", torch.tensor(resolutions))
        start = 1e-2 * (torch.rand(levels, 2**table_bits, features) - 0.5)
        self.table = nn.Parameter(start)
        self.width = levels * features

    resolutions: Tensor

    def forward(self, positions: Tensor) -> Tensor:
        """Read features at positions (..., 3), answer (..., width)."""
        flat = ((positions.reshape(-1, 3) + 1) / 2).clamp(0.0, 1.0)
        if positions.device.type == "cpu":
            features: Any = _CompiledGrid.apply(flat, self.table, self.resolutions)
        else:
            features = self.plain(flat)
        return features.reshape(*positions.shape[:-1], self.width)

    def plain(self, unit: Tensor) -> Tensor:
        """Do the same in plain tensor operations, positions in [0, 1]."""
        found = []
        for level, resolution in enumerate(self.resolutions.tolist()):
            place = unit * resolution
            cell = place.floor().clamp(0, resolution - 1)
            part = place - cell
            total = self.table.new_zeros(len(unit), self.table.shape[2])
            for corner in CORNERS:
                offset = torch.tensor(corner, device=unit.device)
                share = torch.where(offset == 1, part, 1 - part).prod(-1)
                index = _hashed(cell.long() + offset, self.table.shape[1])
                total = total + share[:, None] * self.table[level, index]
            found.append(total)
        return torch.cat(found, dim=-1)


def _hashed(corner: Tensor, entries: int) -> Tensor:
    mixed = corner[:, 0] * PRIMES[0]
    mixed = mixed ^ (corner[:, 1] * PRIMES[1]) ^ (corner[:, 2] * PRIMES[2])
    return mixed & (entries - 1)


class _CompiledGrid(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, unit: Tensor, table: Tensor, resolutions: Tensor) -> Tensor:
        from fields.layers.hash_kernel import read_grid

        arrays = [_array(unit.float()), _array(table.float()), _array(resolutions)]
        ctx.arrays = arrays
        return torch.from_numpy(read_grid(*arrays))

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> Any:
        from fields.layers.hash_kernel import spread_gradient

        unit, table, resolutions = ctx.arrays
        gradient = _array(gradients[0].float())
        spread = spread_gradient(unit, table.shape, resolutions, gradient)
        return None, torch.from_numpy(spread), None


def _array(tensor: Tensor) -> np.ndarray:
    return np.ascontiguousarray(tensor.detach().numpy())
