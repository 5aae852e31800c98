"""Poses for the reciprocity loss: those of the data, moved and turned."""

import torch
from torch import Tensor

from fields.layers.query import Query

__all__ = ["moved", "random_axes"]

NEAREST_M = 0.2
"""No device stands nearer to another: half the size of a loudspeaker."""


def moved(
    query: Query,
    spread: float,
    box: tuple[Tensor, Tensor],
    random: torch.Generator,
    *,
    both: bool,
) -> Query:
    """Add noise to the listener, or to both ends, and take back what is unfit.

    Parameters
    ----------
    query : Query
        Poses of the data.
    spread : float
        Standard deviation per coordinate, metres.
    box : tuple of Tensor
        Corners that no end may leave, each shape (3,), metres.
    random : torch.Generator
        Source of randomness.
    both : bool
        Move the emitter as well.

    Returns
    -------
    Query
        A noisy place outside the box, or within 0.2 m of the other end, is
        replaced by the place of the data.
    """
    noise = spread * torch.randn(2, len(query), 3, generator=random)
    noise = noise.to(query.emitter.device)
    emitter = _inside(query.emitter + noise[0], query.emitter, box)
    emitter = emitter if both else query.emitter
    listener = _inside(query.listener + noise[1], query.listener, box)
    near = (emitter - listener).norm(dim=-1, keepdim=True) < NEAREST_M
    listener = torch.where(near, query.listener, listener)
    emitter = torch.where(near, query.emitter, emitter)
    return Query(emitter, query.emitter_axes, listener, query.listener_axes)


def _inside(place: Tensor, fallback: Tensor, box: tuple[Tensor, Tensor]) -> Tensor:
    fits = ((place >= box[0]) & (place <= box[1])).all(-1, keepdim=True)
    return torch.where(fits, place, fallback)


def random_axes(count: int, random: torch.Generator) -> Tensor:
    """Return uniformly distributed device axes, shape (count, 3, 3)."""
    matrix = torch.randn(count, 3, 3, generator=random)
    axes, upper = torch.linalg.qr(matrix)
    axes = axes * torch.sign(torch.diagonal(upper, dim1=-2, dim2=-1))[:, None]
    # A reflection would turn left into right.
    flip = torch.sign(torch.linalg.det(axes))[:, None, None]
    return axes * torch.cat([flip, torch.ones_like(flip), torch.ones_like(flip)], -1)
