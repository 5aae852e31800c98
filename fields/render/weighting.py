"""A listener's gain pattern as weights on the rays."""

from collections.abc import Callable

import torch
from torch import Tensor

from fields.layers.harmonics import harmonics
from fields.layers.query import Query

__all__ = ["RayWeighting", "omni_weighting", "pattern_weighting", "single_harmonic"]

RayWeighting = Callable[..., Tensor]
"""Called with a query, directions away from the listener (rays, 3) in the room or,
with ``local=True``, (batch, rays, 3) in its frame; returns (batch, rays)."""


def omni_weighting(query: Query, rays: Tensor, *, local: bool = False) -> Tensor:  # noqa: ARG001
    """Weigh every ray alike."""
    return torch.ones(len(query), rays.shape[-2], device=rays.device)


def pattern_weighting(coefficients: Tensor) -> RayWeighting:
    """Weigh rays by harmonic coefficients of a pattern in the device frame.

    Parameters
    ----------
    coefficients : Tensor
        Shape (harmonics,), or (batch, harmonics) for one pattern a query.
    """
    order = round(coefficients.shape[-1] ** 0.5) - 1

    def weigh(query: Query, rays: Tensor, *, local: bool = False) -> Tensor:
        seen = rays if local else torch.einsum("ri,bij->brj", rays, query.listener_axes)
        basis = harmonics(seen, order)
        if coefficients.ndim == 1:
            return basis @ coefficients
        return (basis * coefficients[:, None]).sum(-1)

    return weigh


def single_harmonic(index: int, order: int) -> RayWeighting:
    """Weigh rays by one spherical harmonic: the basis of any pattern."""
    coefficients = torch.zeros((order + 1) ** 2)
    coefficients[index] = 1.0
    return pattern_weighting(coefficients)
