"""Encodings of positions and directions."""

import math
from typing import Annotated

import torch
from pydantic import Field
from torch import Tensor, nn

__all__ = ["Octaves", "Sinusoids", "shoulder"]

Octaves = Annotated[int, Field(ge=0, le=24)]
"""How many frequencies a setting asks for: float32 resolves 24 halvings, no more."""


class Sinusoids(nn.Module):
    """Sines and cosines of octave-spaced frequencies, beside the value itself.

    Parameters
    ----------
    octaves : int
        Number of frequencies; the lowest has period 2, each next one half of it.
    dimensions : int
        Length of the encoded vector.
    """

    def __init__(self, octaves: int, dimensions: int = 3) -> None:
        super().__init__()
        frequencies = math.pi * 2.0 ** torch.arange(octaves)
        self.register_buffer("frequencies", frequencies, persistent=False)
        self.width = dimensions * (1 + 2 * octaves)

    frequencies: Tensor

    def forward(self, values: Tensor) -> Tensor:
        """Encode values of shape (..., dimensions) to (..., width)."""
        angles = (values[..., None] * self.frequencies).flatten(-2)
        return torch.cat([values, angles.sin(), angles.cos()], dim=-1)


def shoulder(values: Tensor, floor: float) -> Tensor:
    """Return the reciprocal of values, held finite below ``floor``."""
    return 1.0 / values.clamp_min(floor)
