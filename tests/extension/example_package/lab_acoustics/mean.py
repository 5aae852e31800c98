"""A model: the mean response, louder near the emitter than far from it."""

from pathlib import Path

import numpy as np

from fields.data import FieldData
from fields.field import paired_queries
from fields.plan import TrainingPlan
from fields.settings import Count, settings
from fields.stored import learned_rows, load_stored, save_stored
from fields.table import FieldKind
from rir import Pose, Poses

NEAREST_M = 0.1
"""Nearer than this, no level is taken or given, m."""


@settings
class Config:
    """What the mean is taken of."""

    every: Count = 1
    "take each so-many-th response"


PRESETS = {"cpu": Config()}


class MeanField:
    """Answer the mean of the learned responses, times 1/distance."""

    name = "mean"

    def __init__(self, data: FieldData, config: Config) -> None:
        self.data, self.config, self.frame = data, config, data.frame
        rows = data.rows(np.arange(0, len(data), config.every))
        far = _distances(rows.emitters, rows.listeners)
        self._mean = (far[:, None] * rows.responses).mean(axis=0)

    def predict(
        self, emitters: Poses | Pose | np.ndarray, listeners: Poses | Pose | np.ndarray
    ) -> np.ndarray:
        """Return responses, shape (queries, n_samples), float32."""
        ends = paired_queries(emitters, listeners)
        answer = self.frame.scale * self._mean / _distances(*ends)[:, None]
        return answer.astype(np.float32)

    def save(self, path: str | Path) -> Path:
        """Write the field to ``path`` with the ending .npz."""
        return save_stored(Path(path), self.name, self.config, self.data)


def _distances(emitters: Poses, listeners: Poses) -> np.ndarray:
    ways = emitters.positions - listeners.positions
    return np.maximum(np.linalg.norm(ways, axis=1), NEAREST_M)


def fit(data: FieldData, config: Config, plan: TrainingPlan) -> MeanField:
    """Keep the rows."""
    return MeanField(learned_rows(data, plan), config)


def load(path: Path) -> MeanField:
    """Open a stored field."""
    config, data = load_stored(path)
    return MeanField(data, Config(**config))


KIND = FieldKind(__name__, "the mean response over distance", "a lab", neural=False)
