"""What a point passes on, linear in the emitter's pattern."""

import math
from typing import Literal, TypeAlias

import torch
from torch import Tensor

from fields.layers.direct import ORDER, local_direction
from fields.layers.harmonics import harmonics
from fields.layers.query import Query
from fields.plan import TrainingPlan

__all__ = ["Emission", "emission_for", "omni_pattern", "sent_features"]

Emission: TypeAlias = Literal[
    "auto", "local", "pattern", "absolute", "absolute-pattern"
]


def emission_for(asked: Emission, plan: TrainingPlan | None = None) -> Emission:
    """Return what points are told of the emitter, where that is left to the plan.

    Offsets share between emitters by themselves; absolute places err less once
    exchange teaches an emitter at every listener's place.

    Parameters
    ----------
    asked : str
        A choice, returned as it is, or "auto".
    plan : TrainingPlan, optional
        The training that is to come; none is one without exchange.

    Examples
    --------
    >>> emission_for("auto"), emission_for("auto", TrainingPlan(exchange="flip"))
    ('pattern', 'absolute-pattern')
    >>> emission_for("local", TrainingPlan(exchange="double"))
    'local'
    """
    if asked != "auto":
        return asked
    exchanged = plan is not None and plan.exchange != "none"
    return "absolute-pattern" if exchanged else "pattern"


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
