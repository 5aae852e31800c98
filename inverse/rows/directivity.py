"""Where loudspeakers look, and how much of their direct levels that explains."""

import numpy as np

from inverse.rows.fitset import FitSet
from rir import Poses
from rir.harmonics import evaluate_harmonics

__all__ = ["DIRECT_S", "aimed_offsets", "direct_windows", "directivity", "row_windows"]

DIRECT_S = 0.0012, 0.0024
"""A direct sound before and after its arrival: a small loudspeaker's pulse fits in,
and in rooms no wall is so near both ends that its echo comes sooner."""
LEVEL_ROWS = 300
"""Levels vary smoothly over directions: more rows would change the fit little."""
LEAST_SPREAD = 0.05
"""Neper of energy, squared: about 1 dB; levels so even are those of an omni."""


def direct_windows(
    reach: np.ndarray,
    speed: float,
    latency_s: float,
    n_samples: int,
    sample_rate: float,
) -> np.ndarray:
    """Return windows that only direct sounds pass, shape (rows, n_samples)."""
    times = np.arange(n_samples) / sample_rate - (reach / speed + latency_s)[:, None]
    before, after = DIRECT_S
    rise = np.clip((times + before) / (0.5 * before), 0, 1)
    fall = np.clip((after - times) / (0.5 * after), 0, 1)
    return np.sin(0.5 * np.pi * np.minimum(rise, fall)) ** 2


def row_windows(rows: FitSet, latency_s: float) -> np.ndarray:
    """Return the windows of measured rows, shape (rows, n_samples)."""
    timing = rows.distances, rows.speed_of_sound, latency_s
    return direct_windows(*timing, rows.n_samples, rows.sample_rate)


def directivity(rows: FitSet, latency_s: float) -> float:
    """Return the part of direct levels' variance that the emitter's aim explains.

    Levels of each emitter place are predicted by a pattern of order 2 that was
    fitted to the other places; 0 where that explains nothing.
    """
    rows = rows.spread(LEVEL_ROWS)
    if rows.n_places < 2:
        return 0.0
    energy = ((rows.responses * row_windows(rows, latency_s)) ** 2).sum(axis=1)
    heard = energy > 1e-9 * max(float(energy.max(initial=0.0)), 1e-300)
    level = np.log(np.where(heard, energy, 1.0) * rows.distances**2 + 1e-300)
    offsets = aimed_offsets(rows.emitters, rows.listeners)
    reach = np.maximum(rows.distances, 1e-6)[:, None]
    basis = evaluate_harmonics(offsets / reach, 2)
    error = np.full(len(rows), np.nan)
    for place in np.unique(rows.places):
        here = rows.places == place
        rest = heard & ~here
        square = basis[rest].T @ basis[rest] + np.eye(basis.shape[1])
        middle = level[rest].mean() if rest.any() else 0.0
        turn = np.linalg.solve(square, basis[rest].T @ (level[rest] - middle))
        error[here] = level[here] - middle - basis[here] @ turn
    spread = float(np.var(level[heard])) if heard.any() else 0.0
    left = float(np.mean(error[heard] ** 2)) if heard.any() else 0.0
    return max(1 - left / spread, 0.0) if spread > LEAST_SPREAD else 0.0


def aimed_offsets(emitters: Poses, listeners: Poses) -> np.ndarray:
    """Return where listeners stand in their emitter's frame, (rows, 3), metres."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_quat(emitters.orientations).inv()
    return np.asarray(turn.apply(listeners.positions - emitters.positions))
