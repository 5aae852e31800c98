"""Fit a box-shaped room to responses: Levenberg-Marquardt, coarse to fine.

Walls, their reflection factors, speed of sound, latency and the emitter's pattern
move together; the pulse, which is linear, is solved for in between.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from inverse.paths.bank import PulseBank
from inverse.paths.descent import TRIES, damped_step, row_weights, trust
from inverse.paths.lattice_kernel import GEOMETRY
from inverse.paths.mesh_room import MeshRoom
from inverse.paths.room import FRONT, BoxRoom
from inverse.rows.fitset import FitSet
from rir.arrays import FloatArray

__all__ = ["BoxStep", "fit_room", "quick_energies", "slow_columns"]

WALL = GEOMETRY + 6
MOST_FACTOR = 1.0  # of reflection: a wall adds no energy
SLOW_HZ = 60.0  # errors below are not counted (decision 0054)
SIGMAS = np.array([0.02] * 3 + [0.1] * 6 + [2.0, 2e-3] + [0.5] * 6)
"""Weak priors: radians, metres, metres per second, seconds, reflection factor."""
BOUND = np.array([0.02] * 3 + [0.03] * 6 + [1.5, 5e-4] + [0.3] * 6)


@dataclass(frozen=True)
class BoxStep:
    """One stage of the fit: how much of the sound, and what may move."""

    edge_hz: float
    order: int
    turns: int
    geometry: bool = True
    pattern: bool = True
    reach_m: float = 1e9


@dataclass(frozen=True, eq=False)
class BoxFit:
    """Hold the fitted room and the covariance of what moved."""

    room: BoxRoom
    covariance: FloatArray
    active: NDArray[np.bool_]
    errors: FloatArray


def fit_room(
    rows: FitSet, room: BoxRoom, step: BoxStep, filtered: FloatArray
) -> BoxFit:
    """Run one stage; `filtered` are the rows as far as the stage hears them."""
    active = _active(room, step)
    power = (filtered**2).sum(axis=1)
    weights = row_weights(power)
    square, right, errors = _sums(rows, room, active, filtered, weights)
    best, damping = float(weights @ errors), 1e-3
    for _ in range(step.turns):
        trusted = weights * trust(errors, power)
        square, right, _ = _sums(rows, room, active, filtered, trusted)
        before = best
        for _ in range(TRIES):
            moved = _moved(room, _bounded(damped_step(square, right, active, damping)))
            found = _errors(rows, moved, filtered)
            now = float(weights @ np.minimum(found, 4 * power))
            if now < best:
                room, best, errors = moved, now, found
                damping = max(damping / 10, 1e-7)
                break
            damping *= 10
        if before - best < 1e-4 * best:
            break
    noise = best / max(float(np.count_nonzero(weights)) * filtered.shape[1], 1.0)
    inner = square[np.ix_(active, active)] + _prior(active, noise)
    covariance = np.linalg.pinv(inner) * noise
    return BoxFit(room, covariance, active, errors)


def _active(room: BoxRoom, step: BoxStep) -> NDArray[np.bool_]:
    heard = room.box.found
    active = np.zeros(WALL + len(room.emitting), dtype=bool)
    if step.geometry:
        active[:3] = heard.sum() >= 2
        active[3:6], active[6:9] = heard[0::2], heard[1::2]
        active[9:11] = True
    active[GEOMETRY:WALL] = heard
    active[WALL:] = step.pattern
    return active


def _sums(
    rows: FitSet,
    room: BoxRoom,
    active: NDArray[np.bool_],
    targets: FloatArray,
    weights: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    from inverse.paths.lattice_kernel import accumulate_rows

    count = len(active)
    square, right = np.zeros((count, count)), np.zeros(count)
    misfit = np.zeros(len(rows))
    accumulate_rows(
        *room.ends(rows.emitters, rows.listeners),
        *room.geometry(targets.shape[1]),
        room.walls,
        room.emitting,
        room.listening,
        room.bank.taps,
        room.bank.lead,
        room.least,
        room.order,
        np.zeros(3),
        room.speed_of_sound,
        room.sample_rate,
        active,
        targets,
        weights,
        slow_columns(targets.shape[1], room.sample_rate),
        square,
        right,
        misfit,
    )
    # latency is counted in samples inside
    square[10] *= room.sample_rate
    square[:, 10] *= room.sample_rate
    right[10] *= room.sample_rate
    return square, right, misfit


def _errors(rows: FitSet, room: BoxRoom, targets: FloatArray) -> FloatArray:
    gap = targets - room.render(rows.emitters, rows.listeners, targets.shape[1])
    return quick_energies(gap, room.sample_rate)


def quick_energies(sound: FloatArray, sample_rate: float) -> FloatArray:
    """Return energies without what lies below `SLOW_HZ`, shape (rows,)."""
    slow = sound @ slow_columns(sound.shape[1], sample_rate)
    return (sound**2).sum(axis=1) - (slow**2).sum(axis=1)


@lru_cache(maxsize=8)
def slow_columns(n_samples: int, sample_rate: float) -> FloatArray:
    """Return orthonormal cosines below `SLOW_HZ`, shape (n_samples, K).

    Loudspeakers, high-passes and rooms' modes rule there; walls cannot be read
    from it, so errors in it are not counted.
    """
    count = min(int(2 * SLOW_HZ * n_samples / sample_rate) + 1, n_samples // 4 + 1)
    at = (np.arange(n_samples) + 0.5) / n_samples
    columns = np.cos(np.pi * at[:, None] * np.arange(count))
    return np.ascontiguousarray(columns / np.linalg.norm(columns, axis=0))


def _prior(active: NDArray[np.bool_], noise: float) -> FloatArray:
    sigmas = np.concatenate([SIGMAS, np.full(len(active) - WALL, 3.0)])[active]
    return np.diag(noise / sigmas**2)


def _bounded(step: FloatArray) -> FloatArray:
    return np.concatenate([np.clip(step[:WALL], -BOUND, BOUND), step[WALL:]])


def _moved(room: BoxRoom, step: FloatArray) -> BoxRoom:
    box = room.box.turned(step[:3])
    box = replace(box, low=box.low + step[3:6], high=box.high + step[6:9])
    walls = np.clip(room.walls + step[GEOMETRY:WALL], -MOST_FACTOR, MOST_FACTOR)
    small = np.abs(walls) < 1e-3
    walls = np.where(small, np.where(walls < 0, -1e-3, 1e-3), walls)
    return replace(
        room,
        shape=box,
        speed_of_sound=room.speed_of_sound + step[9],
        latency_s=room.latency_s + step[10],
        walls=walls,
        emitting=room.emitting + step[WALL:],
    )


def fit_bank(
    rows: FitSet, room: BoxRoom | MeshRoom, taps: int, lead: int, ridge: float = 1e-6
) -> PulseBank:
    """Solve for the pulse that suits the images best.

    The grid of moments of every row, correlated with itself and with the row,
    gives normal equations that are Toeplitz in the taps.
    """
    moments = room.bank.taps.shape[0]
    n = rows.n_samples
    size = int(2 ** np.ceil(np.log2(n + 2 * taps + 8)))
    auto = np.zeros((moments, moments, size))
    cross = np.zeros((moments, size))
    fade = _fade(n)
    weights = 1 / np.maximum((rows.responses**2).sum(axis=1), 1e-300)
    spectra_auto = np.zeros((moments, moments, size // 2 + 1), dtype=complex)
    spectra_cross = np.zeros((moments, size // 2 + 1), dtype=complex)
    grids = _grids(rows, room, lead)
    weights = np.sqrt(weights)[:, None] * fade
    hertz = np.arange(size // 2 + 1) * room.sample_rate / size
    quick = np.sin(0.5 * np.pi * np.clip(hertz / (2 * SLOW_HZ), 0, 1)) ** 2
    heard = np.fft.rfft(rows.responses * weights, size) * quick
    spectra = np.fft.rfft(grids * weights, size) * quick
    for a in range(moments):
        spectra_cross[a] = (spectra[a].conj() * heard).sum(axis=0)
        for b in range(a, moments):
            spectra_auto[a, b] = (spectra[a].conj() * spectra[b]).sum(axis=0)
    auto, cross = np.fft.irfft(spectra_auto, size), np.fft.irfft(spectra_cross, size)
    square = np.empty((moments, taps, moments, taps))
    lags = np.arange(taps)[:, None] - np.arange(taps)
    for a in range(moments):
        for b in range(a, moments):
            # <G_a(t - i), G_b(t - j)> depends on i - j
            block = auto[a, b][lags % size]
            square[a, :, b, :] = block
            square[b, :, a, :] = block.T
    flat = square.reshape(moments * taps, -1)
    right = cross[:, :taps].reshape(-1)
    trace = np.trace(flat) / len(flat)
    flat[np.diag_indices_from(flat)] += ridge * trace
    solved = np.linalg.solve(flat, right).astype(np.float64)
    return PulseBank(np.ascontiguousarray(solved.reshape(moments, taps)), lead)


def _grids(rows: FitSet, room: BoxRoom | MeshRoom, lead: int) -> FloatArray:
    """Return what each moment's first tap multiplies, (moments, rows, n)."""
    ends, n = (rows.emitters, rows.listeners), rows.n_samples
    if isinstance(room, BoxRoom):
        late = FRONT + lead
        grid = room.moments(*ends, late + n, n)[:, :, late:]
        return np.ascontiguousarray(grid.swapaxes(0, 1))
    unit = np.eye(room.bank.taps.shape[0])[:, :, None]
    return np.array([room.render(*ends, n, PulseBank(tap, lead)) for tap in unit])


def _fade(n: int) -> FloatArray:
    fade = np.ones(n)
    tail = max(n // 10, 1)
    fade[-tail:] = np.cos(0.5 * np.pi * np.arange(tail) / tail) ** 2
    return fade
