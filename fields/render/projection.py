"""The exact causal sum over points, without anything of size points x time.

A point's signal is W z + b, so the sum over points of weight x mask x (W z + b)
can be taken over z first. The mask of a point (silence before the emitter's
sound arrives) is a step in time, hence a running sum: one pass over time keeps
the sum of features per shell, adds each point when its time comes and
multiplies by one row of W.
"""

from typing import Any

import numpy as np
import torch
from torch import Tensor

__all__ = ["causal_projection", "causal_projection_plain", "causal_projections"]


def causal_projection(
    features: Tensor,
    weights: Tensor,
    shells: Tensor,
    arrivals: Tensor,
    delays: Tensor,
    matrix: Tensor,
    bias: Tensor,
) -> Tensor:
    """Sum the signals of one listener's points.

    Parameters
    ----------
    features : Tensor
        Shape (points, width).
    weights : Tensor
        Share of each point, shape (points,).
    shells : Tensor
        Shell of each point, shape (points,), int64.
    arrivals : Tensor
        Sample before which each point is silent, shape (points,), int64.
    delays : Tensor
        Samples from each shell to the listener, shape (shells,), int64.
    matrix, bias : Tensor
        Last layer of the signal network, shapes (n_samples, width), (n_samples,).

    Returns
    -------
    Tensor
        Shape (n_samples,); what would arrive later is cut off.
    """
    if features.device.type != "cpu":
        return causal_projection_plain(
            features, weights, shells, arrivals, delays, matrix, bias
        )
    return _CompiledSum.apply(
        features.float(),
        weights.float(),
        shells,
        arrivals,
        delays,
        matrix.float(),
        bias.float(),
    )  # pyright: ignore[reportReturnType]


def causal_projections(
    features: Tensor,
    weights: Tensor,
    shells: Tensor,
    arrivals: Tensor,
    last: tuple[Tensor, Tensor, Tensor],
) -> Tensor:
    """Do so for a batch of listeners, (batch, rays, points ...) to (batch, n).

    ``last`` holds the delays of the shells, and matrix and bias of the last layer.
    """
    # Unbound, because the gradient of an index is as large as the whole batch.
    given = (
        features.flatten(1, 2).unbind(),
        weights.flatten(1).unbind(),
        shells.flatten(1).unbind(),
        arrivals.flatten(1).unbind(),
    )
    return torch.stack(
        [causal_projection(*item, *last) for item in zip(*given, strict=True)]
    )


def causal_projection_plain(
    features: Tensor,
    weights: Tensor,
    shells: Tensor,
    arrivals: Tensor,
    delays: Tensor,
    matrix: Tensor,
    bias: Tensor,
) -> Tensor:
    """Do the same in plain tensor operations, shell by shell, on any device."""
    n_samples, width = matrix.shape
    wide = torch.cat([features, features.new_ones(len(features), 1)], dim=1)
    wide = wide * weights[:, None]
    layer = torch.cat([matrix, bias[:, None]], dim=1)
    total = features.new_zeros(n_samples)
    for shell, delay in enumerate(delays.tolist()):
        mine = shells == shell
        if delay >= n_samples or not bool(mine.any()):
            continue
        sums = features.new_zeros(n_samples, width + 1)
        sums = sums.index_add(0, arrivals[mine], wide[mine]).cumsum(0)
        signal = (sums * layer).sum(-1)
        total = total + torch.nn.functional.pad(signal[: n_samples - delay], (delay, 0))
    return total


class _CompiledSum(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, *inputs: Tensor) -> Tensor:
        from fields.render.projection_kernel import sum_forward

        arrivals = _array(inputs[3])
        order = np.argsort(arrivals, kind="stable")
        ctx.save_for_backward(*inputs)
        ctx.order = order
        arrays: Any = [*(_array(one) for one in inputs), order]
        return torch.from_numpy(sum_forward(*arrays))

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> Any:
        from fields.render.projection_kernel import sum_backward

        arrays: Any = [_array(one) for one in ctx.saved_tensors]
        arrays += [ctx.order, _array(gradients[0])]
        found = sum_backward(*arrays)
        features, weights, matrix, bias = (torch.from_numpy(one) for one in found)
        return features, weights, None, None, None, matrix, bias


def _array(tensor: Tensor) -> np.ndarray:
    return np.ascontiguousarray(tensor.detach().numpy())
