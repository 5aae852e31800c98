"""How much of the measured sound a model does not explain."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from inverse.rows.fitset import FitSet
from rir import Poses

__all__ = [
    "BELIEVED",
    "CLEAN",
    "EXACT",
    "POOR",
    "Predictor",
    "unexplained_energy",
]

EXACT = 10 ** (-25 / 10)
"""Part of the energy left by paths that explain all: -25 dB, a simulator's windows."""
CLEAN = 0.003
"""Paths that leave less explain the room: about -25 dB, rounded for the documents."""
BELIEVED = 0.2
"""Paths that leave less than a fifth are believed: other answers leave more."""
POOR = 0.85
"""Paths that leave more say little of the waveforms: the room has other walls."""


class Predictor(Protocol):
    """Whatever predicts responses between poses."""

    def predict(
        self, emitters: Poses, listeners: Poses, n_samples: int
    ) -> NDArray[np.float64]:
        """Return responses, shape (rows, n_samples)."""
        ...


def unexplained_energy(rows: FitSet, model: Predictor) -> float:
    """Return the part of the rows' energy that a model does not predict."""
    answer = model.predict(rows.emitters, rows.listeners, rows.n_samples)
    power = max(float((rows.responses**2).sum()), 1e-300)
    return float(((rows.responses - answer) ** 2).sum()) / power
