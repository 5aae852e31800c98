"""The emitter's gain pattern, read from measured responses.

Do not ask a network: the direct sound of every response is a sample of the
pattern. Each is read by a matched filter a few samples wide at the known delay,
responses whose first reflection comes too early are left out, and spherical
harmonics in the emitter's own frame are fitted robustly over all of them.
"""

from dataclasses import dataclass

import numpy as np

from fields.data import FieldData
from rir import GainPattern, Poses, RoomSpec
from rir.harmonics import evaluate_harmonics, harmonic_count

__all__ = ["PatternFit", "departures", "direct_levels", "fit_emitter_pattern"]

HALF_WIDTH = 4  # samples either side: the main lobe of a band-limited pulse and three
GATE_SAMPLES = 2 * HALF_WIDTH  # a reflection later than this leaves the filter alone
ROUNDS = 20  # of reweighting, whose weights converge geometrically
HUBER = 1.5  # robust spreads: 96 % as good as least squares where noise is normal
RIDGE = 1e-6  # of a coefficient: holds directions nobody measured, moves no other


@dataclass(frozen=True, eq=False)
class PatternFit:
    """Hold a fitted pattern and how well it explains the direct sounds."""

    pattern: GainPattern
    """One band, device frame, on the scale 1/distance."""
    residual: float
    """Root mean square of what is not explained, same scale."""
    responses: int
    """Direct sounds used."""


def fit_emitter_pattern(data: FieldData, order: int = 4) -> PatternFit | None:
    """Fit the emitter's pattern to the direct sounds.

    Parameters
    ----------
    data : FieldData
        Responses with poses, an omnidirectional listener (or divided by a
        known pattern, which is done here).
    order : int
        Highest degree; lowered until there are three direct sounds for each
        coefficient.

    Returns
    -------
    PatternFit or None
        None when fewer than three responses have a clean direct sound, or all are
        silent.
    """
    levels, clean = direct_levels(data)
    directions = departures(data.emitters, data.listeners)
    if data.frame.listener_gain is not None:
        arriving = departures(data.listeners, data.emitters)
        heard = data.frame.listener_gain.gain(arriving).mean(axis=-1)
        clean &= np.abs(heard) > 0.1
        levels = levels / np.where(np.abs(heard) > 0.1, heard, 1.0)
    levels, directions = levels[clean], directions[clean]
    if len(levels) < 3 or not levels.any():
        return None
    while order > 0 and len(levels) < 3 * harmonic_count(order):
        order -= 1
    coefficients, residual = _robust_fit(directions, levels, order)
    full = np.zeros((1, harmonic_count(4)))
    full[0, : len(coefficients)] = coefficients
    pattern = GainPattern(full, np.array([1000.0]))
    return PatternFit(pattern, residual, len(levels))


def direct_levels(data: FieldData) -> tuple[np.ndarray, np.ndarray]:
    """Read the level of each direct sound times its distance.

    Returns
    -------
    tuple of numpy.ndarray
        Levels, shape (rows,), and whether the direct sound stands alone.
    """
    frame = data.frame
    distance = _distances(data.emitters, data.listeners)
    delay = distance / frame.speed_of_sound * frame.sample_rate
    start = np.floor(delay).astype(int) - HALF_WIDTH
    times = start[:, None] + np.arange(2 * HALF_WIDTH + 2)
    inside = (start >= 0) & (times[:, -1] < frame.n_samples)
    safe = np.clip(times, 0, frame.n_samples - 1)
    heard = np.take_along_axis(np.asarray(data.responses), safe, axis=1)
    pulse = np.sinc(times - delay[:, None])
    levels = distance * (heard * pulse).sum(axis=1) / (pulse**2).sum(axis=1)
    gap = _first_reflection(data, distance) - delay
    return levels, inside & (gap > GATE_SAMPLES) & (distance > 0.2)


def _first_reflection(data: FieldData, distance: np.ndarray) -> np.ndarray:
    """Return the arrival of the earliest wall reflection, samples."""
    ends = data.emitters.positions, data.listeners.positions
    low, high = _walls(data.frame.room, *ends)
    shortest = np.full(len(distance), np.inf)
    for axis in range(3):
        for wall in (low[axis], high[axis]):
            gaps = (ends[0][:, axis] - wall) * (ends[1][:, axis] - wall)
            longer = np.sqrt(distance**2 + 4 * np.maximum(gaps, 0.0))
            shortest = np.minimum(shortest, longer)
    return shortest / data.frame.speed_of_sound * data.frame.sample_rate


def _walls(
    room: RoomSpec | None, emitters: np.ndarray, listeners: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    if room is not None and room.mesh is None:
        return np.zeros(3), np.asarray(room.size_m, dtype=np.float64)
    ends = np.vstack([emitters, listeners])
    return ends.min(axis=0) - 0.3, ends.max(axis=0) + 0.3


def departures(emitters: Poses, listeners: Poses) -> np.ndarray:
    """Return directions to the listeners in the emitters' frames, (rows, 3)."""
    from rir.pose import rotate

    offset = listeners.positions - emitters.positions
    length = np.maximum(np.linalg.norm(offset, axis=1, keepdims=True), 1e-9)
    inverse = emitters.orientations * np.array([-1.0, -1.0, -1.0, 1.0])
    return rotate(inverse, offset / length)


def _distances(emitters: Poses, listeners: Poses) -> np.ndarray:
    return np.linalg.norm(emitters.positions - listeners.positions, axis=1)


def _robust_fit(
    directions: np.ndarray, levels: np.ndarray, order: int
) -> tuple[np.ndarray, float]:
    basis = evaluate_harmonics(directions, order)
    weights = np.ones(len(levels))
    ridge = RIDGE * len(levels) * np.eye(basis.shape[1])
    coefficients = np.zeros(basis.shape[1])
    misfit = np.abs(levels)
    for _ in range(ROUNDS):
        weighted = basis * weights[:, None]
        coefficients = np.linalg.solve(basis.T @ weighted + ridge, weighted.T @ levels)
        misfit = np.abs(levels - basis @ coefficients)
        spread = HUBER * 1.4826 * max(float(np.median(misfit)), 1e-9)
        # Beyond the Huber corner an echo in the window must not pull the fit.
        weights = np.minimum(1.0, spread / np.maximum(misfit, 1e-12)) ** 2
    weight = max(float(weights.sum()), 1e-9)
    residual = float(np.sqrt(np.sum(weights * misfit**2) / weight))
    return coefficients, residual
