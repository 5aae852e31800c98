"""A cheap form of the causal sum: features in delay bins, a bank of responses.

Each point puts its features at the total delay emitter - point - listener;
every feature channel is then filtered by one learned response. The cost does not
depend on the number of points, and nothing can arrive too early.
"""

import torch
from torch import Tensor

__all__ = ["bank_sum"]


def bank_sum(features: Tensor, weights: Tensor, delays: Tensor, bank: Tensor) -> Tensor:
    """Filter weighted features, binned by their delay.

    Parameters
    ----------
    features : Tensor
        Shape (batch, points, channels).
    weights : Tensor
        Shape (batch, points).
    delays : Tensor
        Total delay of each point, shape (batch, points), samples, not whole.
    bank : Tensor
        One response a channel, shape (channels, n_samples).

    Returns
    -------
    Tensor
        Shape (batch, n_samples).
    """
    batch, _, channels = features.shape
    n_samples = bank.shape[1]
    whole = delays.floor()
    part = (delays - whole)[..., None]
    place = whole.long()
    shares = features * weights[..., None]
    # The last two bins catch what arrives after the end.
    bins = features.new_zeros(batch, n_samples + 2, channels)
    for offset, share in ((0, shares * (1 - part)), (1, shares * part)):
        index = (place + offset).clamp(0, n_samples + 1)[..., None]
        bins = bins.scatter_add(1, index.expand(-1, -1, channels), share)
    spectrum = torch.fft.rfft(bins[:, :n_samples], 2 * n_samples, dim=1)
    filters = torch.fft.rfft(bank, 2 * n_samples).transpose(0, 1)
    return torch.fft.irfft((spectrum * filters).sum(-1), 2 * n_samples)[:, :n_samples]
