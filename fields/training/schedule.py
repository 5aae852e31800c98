"""Which rows a step sees, with what randomness and what learning rate.

Everything here is a function of the seed and the step's number, so that a
training that was interrupted continues bit by bit as if it had not been.
"""

import math

import torch
from torch import Tensor

__all__ = ["batch_rows", "cosine", "step_random"]


def step_random(seed: int, step: int, rank: int = 0) -> torch.Generator:
    """Return the generator of one step."""
    mixed = (seed * 1_000_003 + step * 97 + rank * 7_919 + 12_345) % (2**63)
    return torch.Generator().manual_seed(mixed)


def batch_rows(count: int, batch_size: int, seed: int, step: int) -> Tensor:
    """Return the rows of a step: each row once an epoch, in a new order each time.

    Parameters
    ----------
    count : int
        Rows to learn from.
    batch_size : int
        Rows a step; clipped to ``count``.
    seed, step : int
        The same two numbers give the same rows.
    """
    size = min(batch_size, count)
    steps_an_epoch = count // size
    epoch, place = divmod(step, steps_an_epoch)
    random = torch.Generator().manual_seed((seed * 7_368_787 + epoch) % (2**63))
    order = torch.randperm(count, generator=random)
    return order[place * size : (place + 1) * size]


def cosine(start: float, end: float, fraction: float) -> float:
    """Return the value of a half cosine from ``start`` to ``end``.

    Examples
    --------
    >>> cosine(1e-3, 1e-4, 0.0), cosine(1e-3, 1e-4, 1.0)
    (0.001, 0.0001)
    """
    swing = 0.5 * (1 + math.cos(math.pi * min(max(fraction, 0.0), 1.0)))
    return end + (start - end) * swing
