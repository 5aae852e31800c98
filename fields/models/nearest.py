"""Nearest neighbour: answer the stored response whose ends lie nearest."""

from pathlib import Path

import numpy as np

from fields.data import FieldData
from fields.field import paired_queries
from fields.plan import TrainingPlan
from fields.settings import settings
from fields.stored import learned_rows, load_stored, save_stored
from rir import Pose, Poses

__all__ = ["PRESETS", "Config", "NearestField", "fit", "load"]


@settings
class Config:
    """Nothing to choose."""


PRESETS = {"cpu": Config()}


class NearestField:
    """Answer from the row with the smallest distance over both ends.

    The distance is Euclidean in the six coordinates of emitter and listener.
    """

    name = "nearest"

    def __init__(self, data: FieldData, config: Config) -> None:
        from scipy.spatial import KDTree

        self.data = data
        self.config = config
        self.frame = data.frame
        self._tree = KDTree(data.endpoints)

    def predict(
        self, emitters: Poses | Pose | np.ndarray, listeners: Poses | Pose | np.ndarray
    ) -> np.ndarray:
        """Return stored responses, shape (queries, n_samples), float32."""
        first, second = paired_queries(emitters, listeners)
        ends = np.hstack([first.positions, second.positions])
        _, rows = self._tree.query(ends)
        return np.float32(self.frame.scale) * self.data.responses[rows]

    def save(self, path: str | Path) -> Path:
        """Write the field to ``path`` with the ending .npz."""
        return save_stored(Path(path), self.name, self.config, self.data)


def fit(data: FieldData, config: Config, plan: TrainingPlan) -> NearestField:
    """Keep the rows, doubled when ends are exchanged."""
    return NearestField(learned_rows(data, plan), config)


def load(path: Path) -> NearestField:
    """Open a stored nearest-neighbour field."""
    config, data = load_stored(path)
    return NearestField(data, Config(**config))
