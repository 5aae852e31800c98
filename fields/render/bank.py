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
    part = delays - whole
    # The last two bins catch what arrives after the end.
    place = whole.long().clamp(0, n_samples)[:, None].expand(-1, channels, -1)
    # Time last: transforms along a strided axis cost twice as much.
    bins = features.new_zeros(batch, channels, n_samples + 2)
    for offset, share in ((0, weights * (1 - part)), (1, weights * part)):
        values = (features * share[..., None]).transpose(1, 2)
        bins = bins.scatter_add(2, place + offset, values)
    length = 2 * n_samples
    spectrum = torch.fft.rfft(bins[..., :n_samples], length)
    filtered = (spectrum * torch.fft.rfft(bank, length)).sum(1)
    return torch.fft.irfft(filtered, length)[:, :n_samples]
