"""How much of each point reaches the listener."""

import torch
from torch import Tensor

__all__ = ["compositing_weights", "drawn_shells", "path_loss"]

NEAREST_M = 0.1  # nearer than this, 1/distance says more of the fit than of sound
UNIFORM_SHARE = 0.1  # of draws given to every shell: bounds the weight of a rare one


def compositing_weights(density: Tensor, steps: Tensor) -> Tensor:
    """Return transmittance times opacity along each ray.

    Parameters
    ----------
    density : Tensor
        Not negative, shape (..., shells), 1/metre.
    steps : Tensor
        Thickness of each shell, shape (shells,), metres.
    """
    depth = density * steps
    before = depth.cumsum(-1) - depth
    return torch.exp(-before) * -torch.expm1(-depth)


def drawn_shells(
    weights: Tensor, count: int, random: torch.Generator | None
) -> tuple[Tensor, Tensor]:
    """Draw a few shells of each ray, more often where the weight is large.

    Systematic draws from nine parts weight and one part uniform; dividing by the
    expected number of draws keeps every sum over shells unbiased.

    Parameters
    ----------
    weights : Tensor
        Compositing weights, shape (..., shells).
    count : int
        Shells to draw from each ray.
    random : torch.Generator or None
        Offset of the draws; None takes the middle of each interval.

    Returns
    -------
    tuple of Tensor
        Shell numbers and the weights that replace the drawn ones, shape
        (..., count).
    """
    shells = weights.shape[-1]
    share = weights.detach() + 1e-12
    share = share / share.sum(-1, keepdim=True)
    share = (1 - UNIFORM_SHARE) * share + UNIFORM_SHARE / shells
    edges = share.cumsum(-1)
    shape = (*weights.shape[:-1], 1)
    offset = torch.full(shape, 0.5)
    if random is not None:
        offset = torch.rand(shape, generator=random)
    places = ((torch.arange(count) + offset) / count).to(weights.device)
    index = torch.searchsorted(edges, places).clamp_max(shells - 1)
    drawn = weights.gather(-1, index) / (count * share.gather(-1, index))
    return index, drawn


def path_loss(n_samples: int, samples_a_metre: float, device: torch.device) -> Tensor:
    """Return 1/distance for every arrival sample, held below 0.1 m."""
    travelled = torch.arange(n_samples, device=device) / samples_a_metre
    return 1.0 / travelled.clamp_min(NEAREST_M)
