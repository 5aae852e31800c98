"""Direct sounds alone: the room without walls, where none is sure.

Level, pulse and timing are fitted to the direct paths as in a box whose walls are too
far to be heard. Whether the loudspeaker's level depends on its aim is judged at places
left out.
"""

from dataclasses import replace

import numpy as np

from inverse.paths.bank import ideal_bank
from inverse.paths.box_fit import BoxStep, fit_bank, fit_room
from inverse.paths.coloring import Coloring
from inverse.paths.oriented_box import FAR_M, OrientedBox
from inverse.paths.polyhedral import FittedMesh
from inverse.paths.room import OMNI, BoxRoom
from inverse.paths.shoebox import FittedRoom
from inverse.rows.direct import DirectSound
from inverse.rows.directivity import DIRECT_S, aimed_offsets, row_windows
from inverse.rows.fitset import FitSet
from rir import GainPattern, Poses
from rir.harmonics import evaluate_harmonics

__all__ = ["fit_open_air", "free_levels"]

ROWS = 80  # rows that are fitted: a pattern of order 4 has 25 numbers, a pulse some 50
TURNS = 2  # level and pulse are linear in turn: the second turn changes little


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
    few = replace(few, responses=few.responses * row_windows(few, direct.latency_s))
    room = _start(few, direct, listening, emitting)
    lead, rest = (round(part * rows.sample_rate) for part in DIRECT_S)
    whole = BoxStep(0.5 * rows.sample_rate, 0, 3, pattern=False)
    fitted = fit_room(few, room, whole, few.responses)
    for _ in range(TURNS):
        bank = fit_bank(few, fitted.room, lead + rest, lead)
        room = replace(fitted.room, bank=bank)
        fitted = fit_room(few, room, whole, few.responses)
    plain = Coloring.none(rows.sample_rate)
    return FittedRoom(fitted.room, plain, fitted.covariance, fitted.active)


def free_levels(
    paths: FittedRoom | FittedMesh | None, emitters: Poses, listeners: Poses
) -> np.ndarray | None:
    """Return levels of direct sounds times distance with nothing in their way.

    Paths that know what stands between the ends have no free level; the pattern
    they were fitted with does. None where there are no paths.
    """
    if paths is None:
        return None
    emitting = paths.room.emitting
    offsets = aimed_offsets(emitters, listeners)
    reach = np.maximum(np.linalg.norm(offsets, axis=1), 1e-6)[:, None]
    order = round(np.sqrt(len(emitting))) - 1
    return np.abs(evaluate_harmonics(offsets / reach, order) @ emitting)


def _start(
    rows: FitSet,
    direct: DirectSound,
    listening: GainPattern | None,
    emitting: GainPattern | None,
) -> BoxRoom:
    peak = direct.pulse[int(np.argmax(np.abs(direct.pulse)))]
    pattern = OMNI if emitting is None else emitting.coefficients.mean(axis=0)
    far = np.full(3, 2 * FAR_M)
    middle = rows.listeners.positions.mean(axis=0)
    hearing = OMNI if listening is None else listening.coefficients.mean(axis=0)
    return BoxRoom(
        OrientedBox(np.eye(3), middle, -far, far, np.zeros(6)),
        rows.speed_of_sound,
        direct.latency_s,
        np.full(6, 1e-3),
        (peak or 1.0) * np.asarray(pattern),
        np.array(hearing),
        ideal_bank(36),
        rows.sample_rate,
        order=0,
    )
