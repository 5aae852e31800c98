"""Linear interpolation between the listeners of the nearest emitter."""

from pathlib import Path

import numpy as np

from fields.data import FieldData
from fields.field import paired_queries
from fields.plan import TrainingPlan
from fields.settings import Count, settings
from fields.stored import learned_rows, load_stored, save_stored
from rir import Pose, Poses

__all__ = ["PRESETS", "Config", "LinearField", "fit", "load"]

SAME_PLACE_M = 1e-3
"""Emitters within a millimetre are one: places are not known better."""


@settings
class Config:
    """Sizes of the interpolation."""

    neighbours: Count = 8
    "rows weighted by inverse distance where no simplex encloses the query"


PRESETS = {"cpu": Config()}


class LinearField:
    """Interpolate waveforms, barycentric where listeners enclose the query.

    With few emitters the six-dimensional hull of emitter and listener is
    degenerate, so the emitter is chosen first (the nearest) and its listeners
    are triangulated in the dimension they truly span (line, plane or space).
    Outside their hull, or where an emitter has too few listeners, the nearest
    rows of the whole set are weighted by inverse distance over both ends.
    """

    name = "linear"

    def __init__(self, data: FieldData, config: Config) -> None:
        from scipy.spatial import KDTree

        self.data = data
        self.config = config
        self.frame = data.frame
        self._rows = KDTree(data.endpoints)
        self._places, owner = _places(data.emitters.positions)
        self._emitters = KDTree(self._places)
        self._meshes = [
            _Mesh(data.listeners.positions, np.flatnonzero(owner == place))
            for place in range(len(self._places))
        ]

    def predict(
        self, emitters: Poses | Pose | np.ndarray, listeners: Poses | Pose | np.ndarray
    ) -> np.ndarray:
        """Return interpolated responses, shape (queries, n_samples), float32."""
        first, second = paired_queries(emitters, listeners)
        answers = np.empty((len(first), self.frame.n_samples), dtype=np.float32)
        _, nearest = self._emitters.query(first.positions)
        for query, place in enumerate(np.atleast_1d(nearest)):
            rows, weights = self._weights(
                first.positions[query], second.positions[query], int(place)
            )
            answers[query] = weights.astype(np.float32) @ self.data.responses[rows]
        return np.float32(self.frame.scale) * answers

    def _weights(
        self, emitter: np.ndarray, listener: np.ndarray, place: int
    ) -> tuple[np.ndarray, np.ndarray]:
        enclosing = self._meshes[place].enclosing(listener)
        if enclosing is not None:
            return enclosing
        count = min(self.config.neighbours, len(self.data))
        distance, rows = self._rows.query(np.hstack([emitter, listener]), k=count)
        distance, rows = np.atleast_1d(distance), np.atleast_1d(rows)
        weights = 1.0 / np.maximum(distance, SAME_PLACE_M)
        return rows, weights / weights.sum()

    def save(self, path: str | Path) -> Path:
        """Write the field to ``path`` with the ending .npz."""
        return save_stored(Path(path), self.name, self.config, self.data)


class _Mesh:
    """Simplices over one emitter's listeners, in the dimension they span."""

    def __init__(self, positions: np.ndarray, rows: np.ndarray) -> None:
        self.rows = rows
        points = positions[rows]
        self.origin = points.mean(axis=0)
        _, sizes, axes = np.linalg.svd(points - self.origin, full_matrices=False)
        self.axes = axes[sizes > 1e-3 * max(float(sizes.max(initial=0.0)), 1e-9)]
        self.simplices = _triangulated((points - self.origin) @ self.axes.T)

    def enclosing(self, position: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the corners around a position and their weights, if any."""
        if self.simplices is None:
            return None
        local = (position - self.origin) @ self.axes.T
        found = int(self.simplices.find_simplex(local))
        if found < 0:
            return None
        affine = self.simplices.transform[found]
        inner = affine[:-1] @ (local - affine[-1])
        weights = np.append(inner, 1.0 - inner.sum())
        return self.rows[self.simplices.simplices[found]], weights


def _triangulated(points: np.ndarray):
    from scipy.spatial import Delaunay, QhullError

    dimension = points.shape[1]
    if dimension < 2 or len(points) < dimension + 2:
        return None
    try:
        return Delaunay(points)
    except QhullError:
        return None


def _places(positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    rounded = np.round(positions / SAME_PLACE_M).astype(np.int64)
    _, first, owner = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
    return positions[first], owner.reshape(-1)


def fit(data: FieldData, config: Config, plan: TrainingPlan) -> LinearField:
    """Keep the rows, doubled when ends are exchanged, and triangulate them."""
    return LinearField(learned_rows(data, plan), config)


def load(path: Path) -> LinearField:
    """Open a stored linear field."""
    config, data = load_stored(path)
    return LinearField(data, Config(**config))
