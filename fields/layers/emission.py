"""What a point passes on, linear in the emitter's pattern."""

import math

import torch
from torch import Tensor

from fields.layers.direct import ORDER, local_direction
from fields.layers.harmonics import harmonics
from fields.training.query import Query

__all__ = ["omni_pattern", "sent_features"]


def omni_pattern() -> Tensor:
    """Return the coefficients of a pattern that is 1 in all directions, (25,)."""
    omni = torch.zeros((ORDER + 1) ** 2)
    omni[0] = math.sqrt(4 * math.pi)
    return omni


def sent_features(
    query: Query, positions: Tensor, features: Tensor, pattern: Tensor
) -> Tensor:
    """Weigh half of the features by the gain towards the point, half by its mean.

    Sound that came straight to a point carries the emitter's gain in that
    direction, sound that wandered about carries the mean over all.

    Parameters
    ----------
    query : Query
        Poses.
    positions : Tensor
        Points, shape (batch, rays, points, 3), metres.
    features : Tensor
        Shape (batch, rays, points, width).
    pattern : Tensor
        Coefficients of the emitter's pattern, shape (25,), device frame.
    """
    offset = positions - query.emitter[:, None, None]
    toward = harmonics(local_direction(offset, query.emitter_axes), ORDER) @ pattern
    mean = pattern[0] / math.sqrt(4 * math.pi)
    half = features.shape[-1] // 2
    straight = features[..., :half] * toward[..., None]
    return torch.cat([straight, features[..., half:] * mean], dim=-1)
