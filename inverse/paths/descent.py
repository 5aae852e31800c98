"""What the fits of boxes and of meshes share: weights of rows and damped steps."""

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray

__all__ = [
    "TRIES",
    "damped_step",
    "root_mean_square",
    "row_weights",
    "spread_of",
    "trust",
]

TRIES = 4  # tenfold dampings of a step that does not help before a stage ends


def row_weights(power: FloatArray) -> FloatArray:
    """Return weights that count rows of any level alike; zero for silent ones."""
    loud = power > 1e-9 * max(float(power.max(initial=0.0)), 1e-300)
    return np.where(loud, 1 / (power + np.median(power) * 0.1 + 1e-300), 0.0)


def trust(errors: FloatArray, power: FloatArray) -> FloatArray:
    """Return small weights for rows that fit far worse than most."""
    share = errors / np.maximum(power, 1e-300)
    middle = float(np.median(share))
    return np.minimum(1.0, 3 * middle / np.maximum(share, 1e-12))


def damped_step(
    square: FloatArray, right: FloatArray, active: NDArray[np.bool_], damping: float
) -> FloatArray:
    """Return the Levenberg-Marquardt step of all parameters; zero where held."""
    step = np.zeros(len(active))
    inner = square[np.ix_(active, active)]
    scale = np.sqrt(np.maximum(np.diag(inner), 1e-300))
    scaled = inner / np.outer(scale, scale)
    scaled[np.diag_indices_from(scaled)] += damping + 1e-9
    step[active] = np.linalg.solve(scaled, right[active] / scale) / scale
    return step


def spread_of(covariance: FloatArray, active: NDArray[np.bool_]) -> FloatArray:
    """Return each parameter's standard deviation; NaN where it was held."""
    spread = np.full(len(active), np.nan)
    spread[active] = np.sqrt(np.clip(np.diag(covariance), 0, None))
    return spread


def root_mean_square(spread: FloatArray) -> float:
    """Return the rms of standard deviations that are known; NaN where none is."""
    known = spread[np.isfinite(spread)]
    return float(np.sqrt((known**2).mean())) if len(known) else float("nan")
