"""Direct sounds alone: the room without walls, where none is sure.

Level, pulse and timing are fitted to the direct paths as in a box whose walls are too
far to be heard. Whether the loudspeaker's level depends on where it looks is told by
places left out.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from inverse.paths.bank import ideal_bank
from inverse.paths.box_fit import Step, fit_bank, fit_room
from inverse.paths.coloring import Coloring
from inverse.paths.room import OMNI, BoxRoom
from inverse.paths.shoebox import FittedRoom
from inverse.rows.direct import DirectSound
from inverse.rows.fitset import FitSet
from inverse.walls.box import FAR_M, OrientedBox
from rir import GainPattern, Poses
from rir.harmonics import evaluate_harmonics

__all__ = [
    "aimed_offsets",
    "direct_windows",
    "directivity",
    "fit_open_air",
    "free_levels",
]

ROWS = 80
TAPS_S = 0.0012, 0.0024
TURNS = 2
LEVEL_ROWS = 300
LEAST_SPREAD = 0.05
"""Neper of energy, squared: about 1 dB."""


def fit_open_air(
    rows: FitSet,
    direct: DirectSound,
    listening: GainPattern | None = None,
    emitting: GainPattern | None = None,
) -> FittedRoom:
    """Fit the direct sounds of rows; nothing reflects.

    Patterns of the devices are taken as known, or as the same all round.
    """
    few = rows.spread(ROWS)
    few = replace(few, responses=few.responses * _windows(few, direct.latency_s))
    room = _start(few, direct, listening, emitting)
    lead, rest = (round(part * rows.sample_rate) for part in TAPS_S)
    whole = Step(0.5 * rows.sample_rate, 0, 3, pattern=False)
    fitted = fit_room(few, room, whole, few.responses)
    for _ in range(TURNS):
        bank = fit_bank(few, fitted.room, lead + rest, lead)
        room = replace(fitted.room, bank=bank)
        fitted = fit_room(few, room, whole, few.responses)
    plain = Coloring.none(rows.sample_rate)
    return FittedRoom(fitted.room, plain, fitted.covariance, fitted.active)


def direct_windows(
    reach: np.ndarray,
    speed: float,
    latency_s: float,
    n_samples: int,
    sample_rate: float,
) -> np.ndarray:
    """Return windows that only direct sounds pass, shape (rows, n_samples)."""
    times = np.arange(n_samples) / sample_rate - (reach / speed + latency_s)[:, None]
    before, after = TAPS_S
    rise = np.clip((times + before) / (0.5 * before), 0, 1)
    fall = np.clip((after - times) / (0.5 * after), 0, 1)
    return np.sin(0.5 * np.pi * np.minimum(rise, fall)) ** 2


def _windows(rows: FitSet, latency_s: float) -> np.ndarray:
    timing = rows.distances, rows.speed_of_sound, latency_s
    return direct_windows(*timing, rows.n_samples, rows.sample_rate)


def directivity(rows: FitSet, latency_s: float) -> float:
    """Return the part of direct levels' variance that the emitter's aim tells.

    Levels of each emitter place are told by a pattern of order 2 that was fitted
    to the other places; 0 where that tells nothing.
    """
    rows = rows.spread(LEVEL_ROWS)
    if rows.n_places < 2:
        return 0.0
    energy = ((rows.responses * _windows(rows, latency_s)) ** 2).sum(axis=1)
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


def free_levels(paths: Any, emitters: Poses, listeners: Poses) -> np.ndarray | None:
    """Return levels of direct sounds times distance with nothing in their way.

    Paths that know what stands between the ends tell no free level; the pattern
    they were fitted with does. None where there is none.
    """
    emitting = getattr(getattr(paths, "room", None), "emitting", None)
    if emitting is None:
        return None
    offsets = aimed_offsets(emitters, listeners)
    reach = np.maximum(np.linalg.norm(offsets, axis=1), 1e-6)[:, None]
    order = round(np.sqrt(len(emitting))) - 1
    return np.abs(evaluate_harmonics(offsets / reach, order) @ emitting)


def aimed_offsets(emitters: Poses, listeners: Poses) -> np.ndarray:
    """Return where listeners stand in their emitter's frame, (rows, 3), metres."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_quat(emitters.orientations).inv()
    return np.asarray(turn.apply(listeners.positions - emitters.positions))


def _start(
    rows: FitSet,
    direct: DirectSound,
    listening: GainPattern | None,
    emitting: GainPattern | None,
) -> BoxRoom:
    peak = direct.pulse[int(np.argmax(np.abs(direct.pulse)))]
    told = OMNI if emitting is None else emitting.coefficients.mean(axis=0)
    far = np.full(3, 2 * FAR_M)
    middle = rows.listeners.positions.mean(axis=0)
    heard = OMNI if listening is None else listening.coefficients.mean(axis=0)
    return BoxRoom(
        OrientedBox(np.eye(3), middle, -far, far, np.zeros(6)),
        rows.speed_of_sound,
        direct.latency_s,
        np.full(6, 1e-3),
        (peak or 1.0) * np.asarray(told),
        np.array(heard),
        ideal_bank(36),
        rows.sample_rate,
        order=0,
    )
