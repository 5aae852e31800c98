"""From an assembled box to a fitted room: the stages in their order."""

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inverse.paths.bank import PulseBank, ideal_bank
from inverse.paths.box_fit import BoxStep, fit_room, slow_columns
from inverse.paths.coloring import Coloring
from inverse.paths.descent import root_mean_square, spread_of
from inverse.paths.oriented_box import OrientedBox
from inverse.paths.polish import polished, without_coloring
from inverse.paths.room import OMNI, BoxRoom
from inverse.rows.direct import DirectSound
from inverse.rows.fitset import FitSet
from rir import GainPattern, Poses
from rir.arrays import FloatArray

__all__ = [
    "FIRST_FACTOR",
    "ORDERS",
    "ROUNDS",
    "FittedRoom",
    "box_error",
    "first_parts",
    "fit_shoebox",
    "low_part",
    "low_passed",
    "pattern_size",
    "with_right_order",
    "without_slow",
]

STAGES = (
    BoxStep(1500.0, 1, 4, pattern=False),
    BoxStep(3000.0, 2, 4),
    BoxStep(6000.0, 4, 4),
)
LOW_ROWS, FULL_ROWS = 48, 20
"""Rows of the coarse stages, which are cheap, and of the whole band, whose 20 rows hold
some 30,000 samples against 42 parameters."""
PATTERN_ORDER = 4
"""Of the emitter: 25 harmonics; small loudspeakers' lobes are no narrower to 4 kHz."""
ROUNDS = 2  # turns of pulse and walls; a third changes nothing that is heard
FIRST_FACTOR = 0.8  # of reflection, before a fit: between carpet and plaster
ORDERS = 24
"""Orders tried one by one for the last; simulators stop earlier or not at all."""


@dataclass(frozen=True, eq=False)
class FittedRoom:
    """Hold a rendered room and how it was fitted."""

    room: BoxRoom
    coloring: Coloring
    covariance: FloatArray
    active: NDArray[np.bool_]

    def predict(self, emitters: Poses, listeners: Poses, n_samples: int) -> FloatArray:
        """Return all paths' sound, shape (rows, n_samples)."""
        render = partial(self.room.render, emitters, listeners)
        return self.coloring.heard(render, n_samples)

    @property
    def speed_of_sound(self) -> float:
        """Metres per second, fitted."""
        return self.room.speed_of_sound

    @property
    def n_walls(self) -> int:
        """Number of walls that were heard."""
        return int(self.room.box.found.sum())

    def spreads(self) -> FloatArray:
        """Return the standard deviation of each parameter; NaN where it was held.

        Three turns (rad), low and high corner (m), speed of sound (m/s), latency
        (s; small, for the pulse takes it), six reflection factors, harmonics of the
        emitter's pattern.
        """
        return spread_of(self.covariance, self.active)

    def wall_sd(self) -> FloatArray:
        """Return the standard deviation of each wall's place, shape (6,), metres."""
        spread = self.spreads()
        walls = np.stack([spread[3:6], spread[6:9]], axis=1).ravel()
        return np.where(np.isfinite(walls), walls, 0.0)

    def family_sd(self) -> dict[str, float]:
        """Return the standard deviation of each kind of parameter, rms over it.

        Of the fit with one factor a wall; the emitter's pattern over its mean gain.
        """
        spread, level = self.spreads(), abs(float(self.room.emitting[0]))
        families = {
            "turn_rad": spread[:3],
            "walls_m": spread[3:9],
            "speed_of_sound_m_s": spread[9:10],
            "latency_s": spread[10:11],
            "reflection": spread[11:17],
            "emitter_pattern": spread[17:] / max(level, 1e-300),
        }
        return {name: root_mean_square(part) for name, part in families.items()}

    def length_sd(self, lengths: FloatArray) -> FloatArray:
        """Return the standard deviation of paths of given lengths, metres.

        A wall's error counts once a bounce; bounces grow with the length over
        the mean free path and their errors add as squares along each axis.
        """
        heard = self.room.box.found
        spread = float(np.mean(self.wall_sd()[heard])) if heard.any() else 0.0
        size = np.minimum(self.room.box.high - self.room.box.low, 60.0)
        free = 2 / np.sum(1 / size)
        bounces = np.asarray(lengths) / max(float(free), 0.1)
        return 1.16 * spread * bounces / np.sqrt(6)


def fit_shoebox(
    rows: FitSet,
    direct: DirectSound,
    box: OrientedBox,
    reach_m: float = 1e3,
    listening: GainPattern | None = None,
    known: BoxRoom | None = None,
) -> FittedRoom:
    """Fit walls, air, devices and pulse of a box to rows.

    Where a room is `known` from low sound, the fit goes on from there: first
    reflections alone would lose walls that only later ones speak for.
    """
    room = replace(_start(rows, direct, box), reach_m=reach_m)
    if known is not None:
        room = _going_on(room, known)
    if listening is not None:
        room = replace(room, listening=listening.coefficients.mean(axis=0))
    few = rows.spread(LOW_ROWS)
    for step in STAGES if known is None else STAGES[-1:]:
        if 2.4 * step.edge_hz > rows.sample_rate:
            continue
        room = _staged(few, room, step)
    few = rows.spread(FULL_ROWS)
    room = replace(room, order=400, bank=ideal_bank(36))
    room = with_right_order(few, room)
    whole = BoxStep(0.5 * rows.sample_rate, room.order, 2)
    coloring = Coloring.none(rows.sample_rate)
    fitted = fit_room(few, room, whole, few.responses)
    fitted = replace(fitted, room=with_right_order(few, fitted.room))
    for turn in range(ROUNDS):
        coloring, room = polished(few, fitted.room, coloring, turn, box_error)
        fitted = replace(fitted, room=room)
        if turn < ROUNDS - 1:
            rest = without_coloring(few, fitted.room, coloring)
            fitted = fit_room(few, fitted.room, whole, rest)
            fitted = replace(fitted, room=with_right_order(few, fitted.room))
    return FittedRoom(fitted.room, coloring, fitted.covariance, fitted.active)


def _going_on(room: BoxRoom, known: BoxRoom) -> BoxRoom:
    emitting = np.zeros(len(room.emitting))
    count = min(len(emitting), len(known.emitting))
    emitting[:count] = known.emitting[:count]
    return replace(
        room,
        shape=known.box,
        walls=known.walls,
        emitting=emitting,
        speed_of_sound=known.speed_of_sound,
        latency_s=known.latency_s,
    )


def _start(rows: FitSet, direct: DirectSound, box: OrientedBox) -> BoxRoom:
    factors = np.where(box.found, FIRST_FACTOR, 1e-3)
    return BoxRoom(box, **first_parts(rows, direct), walls=factors)


def first_parts(rows: FitSet, direct: DirectSound) -> dict[str, Any]:
    """Return parts of a room to start from: the same level all round, a short pulse."""
    peak = direct.pulse[int(np.argmax(np.abs(direct.pulse)))]
    emitting = np.zeros(pattern_size(rows))
    emitting[0] = np.sqrt(4 * np.pi) * (peak or 1.0)
    return {
        "speed_of_sound": rows.speed_of_sound,
        "latency_s": direct.latency_s,
        "emitting": emitting,
        "listening": OMNI.copy(),
        "bank": ideal_bank(36),
        "sample_rate": rows.sample_rate,
    }


def pattern_size(rows: FitSet) -> int:
    """Return the harmonics that the rows' directions can tell apart."""
    order = PATTERN_ORDER
    while order > 0 and len(rows) < 2 * (order + 1) ** 2:
        order -= 1
    return (order + 1) ** 2


def _staged(rows: FitSet, room: BoxRoom, step: BoxStep) -> BoxRoom:
    bank, low = low_part(rows, step.edge_hz)
    moved = replace(room, bank=bank, order=step.order)
    return fit_room(rows, moved, step, low).room


def low_part(rows: FitSet, edge_hz: float) -> tuple[PulseBank, FloatArray]:
    """Return the pulse of a low-pass, and the rows through it, (rows, samples)."""
    share = min(2 * edge_hz / rows.sample_rate, 1.0)
    bank = ideal_bank(2 * int(np.ceil(8 / share)), share)
    return bank, low_passed(rows.responses, share)


def low_passed(responses: FloatArray, share: float) -> FloatArray:
    """Return responses through the low-pass whose pulse `ideal_bank` has."""
    half = int(np.ceil(8 / share))
    at = np.arange(-half, half + 1)
    window = np.i0(8.0 * np.sqrt(np.clip(1 - (at / half) ** 2, 0, None))) / np.i0(8.0)
    pulse = share * np.sinc(share * at) * window
    size = responses.shape[1] + 2 * half
    spectra = np.fft.rfft(responses, size) * np.fft.rfft(pulse, size)
    return np.fft.irfft(spectra, size)[:, half : half + responses.shape[1]]


def _rendered(rows: FitSet, room: BoxRoom) -> FloatArray:
    return room.render(rows.emitters, rows.listeners, rows.n_samples)


def with_right_order(rows: FitSet, room: BoxRoom) -> BoxRoom:
    """Stop at the order where the sound stops, as simulators do.

    The last order is the one that leaves the smallest error.
    """
    rest = without_slow(rows.responses, rows.sample_rate)
    errors = [(rest**2).sum()]
    for order in range(ORDERS):
        part = _rendered(rows, room.with_order(order, order))
        rest = rest - without_slow(part, rows.sample_rate)
        errors.append((rest**2).sum())
    part = _rendered(rows, room.with_order(ORDERS, 400))
    rest = rest - without_slow(part, rows.sample_rate)
    best = int(np.argmin(errors)) - 1
    whole = (rest**2).sum() <= 1.02 * min(errors)
    return replace(room, least=0, order=400 if whole else max(best, 1))


def without_slow(responses: FloatArray, sample_rate: float) -> FloatArray:
    """Return responses without what is slower than fits count, (rows, samples)."""
    slow = slow_columns(responses.shape[1], sample_rate)
    return responses - (responses @ slow) @ slow.T


def box_error(rows: FitSet, room: BoxRoom, target: FloatArray) -> float:
    """Return the squared error of a box's images above 60 Hz, summed over rows."""
    gap = target - _rendered(rows, room)
    return float((without_slow(gap, rows.sample_rate) ** 2).sum())
