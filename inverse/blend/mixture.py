"""Weights of several predictions, tile by tile, by least squares.

Fitted paths, interpolated rows and a trained network err in different octaves and at
different times. Each tile takes the sum of their waveforms that came nearest to the
measured ones where the emitter had been left out. Sums of answers that do not change
when the ends are exchanged do not change either.
"""

from collections.abc import Sequence

import numpy as np

from inverse.rows.tiles import Tiles
from inverse.rows.unexplained import EXACT
from rir.arrays import FloatArray

__all__ = ["mix", "mixing_weights"]

RIDGE = 0.02
"""Of each answer's own energy: parts answers that are nearly alike, costs 2 %."""
QUIET = 1e-12  # 120 dB below the loudest tile: rounding
MOST_WEIGHT = 1.2
"""Least squares makes answers quieter, never much louder; more is chance."""
LEAST_WEIGHT = 0.05  # smaller amplitudes, -26 dB, change nothing and cost a filter bank


def mix(tiles: Tiles, weights: FloatArray, answers: Sequence[FloatArray]) -> FloatArray:
    """Return the weighted sum of answers, shape (rows, n).

    Parameters
    ----------
    tiles : Tiles
        Octaves and bins.
    weights : ndarray, shape (answers, bands, bins)
        Amplitudes; an answer of weight 1 everywhere comes back untouched.
    answers : sequence of ndarray, each of shape (rows, n)
        What is mixed.
    """
    out = np.zeros_like(answers[0])
    for answer, weight in zip(answers, weights, strict=True):
        if weight.any():
            every = np.broadcast_to(weight, (len(answer), *weight.shape))
            out += tiles.gained(answer, every)
    return out


def mixing_weights(
    measured: FloatArray, answers: Sequence[FloatArray], tiles: Tiles
) -> FloatArray:
    """Return the amplitudes that bring answers nearest to measured rows.

    Parameters
    ----------
    measured : ndarray, shape (rows, n)
        Measured responses.
    answers : sequence of ndarray, each of shape (rows, n)
        Predictions for them, made without rows of their emitter.
    tiles : Tiles
        Octaves and bins.

    Returns
    -------
    ndarray, shape (voices, bands, bins)
        Least squares in each tile, drawn to zero by a small ridge. Where the
        first voice explains a tile it is taken as it is.
    """
    loud = np.maximum((measured**2).sum(axis=1), 1e-300)
    even = (1 / np.sqrt(loud))[:, None]
    heard = measured * even
    spoken = [one * even for one in answers]
    count = len(spoken)
    power = tiles.energies(heard).sum(axis=0)
    square = np.zeros((count, count, *power.shape))
    right = np.zeros((count, *power.shape))
    for k, one in enumerate(spoken):
        right[k] = tiles.products(heard, one).sum(axis=0)
        for other in range(k, count):
            square[k, other] = tiles.products(one, spoken[other]).sum(axis=0)
            square[other, k] = square[k, other]
    left = power - 2 * right[0] + square[0, 0]
    explained = left <= EXACT * power + QUIET * power.max(initial=0.0)
    diagonal = np.einsum("kkbt->kbt", square)
    floor = QUIET * max(float(diagonal.max(initial=0.0)), 1e-300)
    scale = np.sqrt(np.maximum(diagonal, floor))
    shape = (scale[:, None] * scale[None]).transpose(2, 3, 0, 1)
    normal = square.transpose(2, 3, 0, 1) / shape + RIDGE * np.eye(count)
    wanted = (right / scale).transpose(1, 2, 0)[..., None]
    solved = np.linalg.solve(normal, wanted)[..., 0].transpose(2, 0, 1) / scale
    weights = np.clip(np.where(diagonal > floor, solved, 0.0), 0, MOST_WEIGHT)
    weights[weights < LEAST_WEIGHT] = 0.0
    alone = np.zeros(count)
    alone[0] = 1.0
    return np.where(explained, alone[:, None, None], weights)
