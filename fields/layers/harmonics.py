"""Real spherical harmonics of directions given as tensors."""

import numpy as np
import torch
from torch import Tensor

from rir import GainPattern
from rir.harmonics import evaluate_harmonics

__all__ = ["broadband_coefficients", "harmonics"]


def harmonics(directions: Tensor, order: int) -> Tensor:
    """Return orthonormal harmonics in ACN order, shape (..., (order + 1)^2).

    No gradient flows to the directions: poses are given, not learned.
    """
    values = evaluate_harmonics(directions.detach().cpu().double().numpy(), order)
    return torch.as_tensor(values, dtype=torch.float32).to(directions.device)


def broadband_coefficients(pattern: GainPattern, order: int) -> np.ndarray:
    """Return one row of coefficients, shape ((order + 1)^2,): the mean over bands."""
    row = np.asarray(pattern.coefficients).mean(axis=0)
    wanted = (order + 1) ** 2
    kept = np.zeros(wanted)
    kept[: min(wanted, len(row))] = row[:wanted]
    return kept
