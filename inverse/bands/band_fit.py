"""Fit walls, air and devices of every half octave to rows: Gauss-Newton, damped."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inverse.bands.band_kernel import LOSS, PATTERN, PHASE
from inverse.bands.banded_room import BandedRoom, most_images
from inverse.bands.half_octaves import HalfOctaves
from inverse.rows.fitset import FitSet
from rir import Poses
from rir.arrays import ComplexArray, FloatArray

__all__ = ["BandData", "band_data", "fit_walls", "tuned"]

FAINT = 0.03
"""Below this share of its greatest magnitude a source counts as noise."""
LOSS_SIGMA, PHASE_SIGMA, PATTERN_SIGMA = 3e-4, 1.0, 0.5
"""Weak priors: nepers a metre, radians, and parts of the level."""
WALL_SIGMA, WALL_SHARE, LOSS_SHARE = 0.01, 0.4, 0.2
"""A wall's factor moves from where a stage starts by a share of it and a little."""
HEARING_SIGMA = 0.3  # of a known listener's pattern, which is stated more surely
MORE_TURNS = 1
"""Turns that make up for a curvature that is kept: they cost little."""
WALL_BOUND, FIRST_DAMPING = 0.1, 0.01
"""Most that a wall moves in a step, over which its factor is nearly linear; damping
that holds only what the rows hardly tell."""
LEAST_ADMITTANCE, MOST_ADMITTANCE = 1e-3, 8.0  # nearly rigid; nearly soft
DEEP_HZ = 110.0  # six walls cannot be told apart below (decision 0057)
LEAST_ROWS = 24  # fewer do not tell the 39 values of a band, with some to judge
KEPT_OUT = 4  # one row of so many judges only: enough to judge by, few lost to the fit


@dataclass(frozen=True, eq=False)
class BandData:
    """Hold rows as envelopes of half octaves, the source's colour taken away.

    Parameters
    ----------
    emitters, listeners : Poses
        Where the ends stand by the fit so far.
    targets : ndarray, shape (rows, total)
        Envelopes.
    weight : ndarray, shape (bins,)
        What an arrival still has of a flat spectrum.
    live : ndarray of bool, shape (total,)
        Envelope samples that count.
    power : ndarray, shape (rows, bands)
        Squared sums of the live samples.
    """

    emitters: Poses
    listeners: Poses
    targets: ComplexArray
    weight: FloatArray
    live: NDArray[np.bool_]
    power: FloatArray

    def moved(self, emitters: Poses, listeners: Poses) -> "BandData":
        """Return the data with other places."""
        return replace(self, emitters=emitters, listeners=listeners)


def band_data(rows: FitSet, grid: HalfOctaves, source: ComplexArray) -> BandData:
    """Return rows as envelopes of the bands, divided by the source's spectrum."""
    spectra = np.fft.rfft(rows.responses, grid.size)
    floor = FAINT**2 * float(np.max(np.abs(source) ** 2)) + 1e-300
    whole = np.abs(source) ** 2 + floor
    weight = np.abs(source) ** 2 / whole
    targets = grid.split(spectra * (source.conj() / whole), np.ones(len(source)))
    live = np.ones(grid.total, dtype=bool)
    power = np.add.reduceat(np.abs(targets) ** 2 * live, grid.starts, axis=1)
    return BandData(rows.emitters, rows.listeners, targets, weight, live, power)


def fit_walls(
    data: BandData,
    banded: BandedRoom,
    turns: int,
    *,
    chosen: NDArray[np.bool_] | None = None,
) -> tuple[BandedRoom, FloatArray]:
    """Move all that belongs to one band only, in the `chosen` bands.

    Returns the room and what each band leaves of its energy, shape (bands,).
    """
    if chosen is None:
        chosen = np.ones(banded.grid.bands, dtype=bool)
    weights = 1 / (data.power + 0.1 * np.median(data.power, axis=0) + 1e-300)
    start = banded
    best = banded
    wide = np.diff(banded.grid.spans, axis=1)[:, 0]
    lowest = np.full(banded.grid.bands, np.inf)
    damping = np.full(banded.grid.bands, FIRST_DAMPING)
    held = None
    for turn in range(turns + MORE_TURNS + 1):
        last = turn == turns + MORE_TURNS
        square, right, misfit = _sums(
            data, banded, weights, chosen, curved=held is None, sloped=not last
        )
        now = (weights * misfit).sum(axis=0)
        better = now < lowest
        banded = _chosen(better, banded, best)
        if held is not None:
            square = held[0]
            right = np.where(better[:, None], right, held[1])
        damping = np.where(better, damping / 5, damping * 10)
        lowest = np.minimum(now, lowest)
        best, held = banded, (square, right)
        if last:
            break
        noise = lowest / (2 * len(weights) * wide)
        step = _steps(square, right, noise, damping, start, banded)
        banded = _moved(banded, np.where(chosen[:, None], step, 0.0))
    return best, lowest / (weights * data.power).sum(axis=0)


def tuned(data: BandData, banded: BandedRoom, band: int) -> BandedRoom:
    """Return the room with one band's level and phase put right."""
    kernels, alone = banded.kernels(data.weight), np.arange(banded.grid.bands) == band
    model = banded.envelopes(data.emitters, data.listeners, kernels, alone)
    first = int(banded.grid.starts[band])
    here = slice(first, first + int(banded.grid.lengths[band]))
    weights = 1 / (data.power[:, band] + 0.1 * np.median(data.power[:, band]))
    cross = weights @ (model[:, here].conj() * data.targets[:, here]).sum(axis=1)
    power = weights @ (np.abs(model[:, here]) ** 2).sum(axis=1)
    factor = cross / max(float(power), 1e-300)
    phase, emitting = banded.phase.copy(), banded.emitting.copy()
    phase[band] += np.angle(factor)
    emitting[band] *= max(float(np.abs(factor)), 0.1)
    return replace(banded, phase=phase, emitting=emitting)


def _sums(
    data: BandData,
    banded: BandedRoom,
    weights: FloatArray,
    chosen: NDArray[np.bool_],
    *,
    curved: bool = True,
    sloped: bool = True,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return curvature, slope and misfit of each band."""
    from inverse.bands.band_sums import accumulate_bands

    count = _columns(banded)
    bands = banded.grid.bands
    square, right = np.zeros((bands, count, count)), np.zeros((bands, count))
    misfit = np.zeros((len(weights), bands))
    add: Any = accumulate_bands
    add(
        *banded.loop_input(data.emitters, data.listeners, banded.kernels(data.weight)),
        most_images(banded),
        data.live,
        chosen,
        curved,
        sloped,
        data.targets,
        weights,
        square,
        right,
        misfit,
    )
    return square, right, misfit


def _columns(banded: BandedRoom) -> int:
    listening = banded.listening.shape[1]
    free = listening if listening > 1 else 0
    return PATTERN + banded.emitting.shape[1] + free


def _values(banded: BandedRoom) -> FloatArray:
    """Return what moves, shape (bands, columns)."""
    walls = np.stack([banded.walls.real, banded.walls.imag], axis=2)
    parts = [
        walls.reshape(len(walls), -1),
        banded.loss[:, None],
        banded.phase[:, None],
        banded.emitting,
    ]
    if banded.listening.shape[1] > 1:
        parts.append(banded.listening)
    return np.concatenate(parts, axis=1)


def _steps(
    square: FloatArray,
    right: FloatArray,
    noise: FloatArray,
    damping: FloatArray,
    start: BandedRoom,
    banded: BandedRoom,
) -> FloatArray:
    """Return the next step of every band, shape (bands, columns)."""
    active = _active(banded)
    level = np.abs(banded.emitting[:, :1])
    sigmas = _sigmas(banded) * np.where(np.arange(_columns(banded)) < PATTERN, 1, level)
    size = np.abs(start.walls).repeat(2, axis=1)
    sigmas[:, :LOSS] = WALL_SIGMA + WALL_SHARE * size
    sigmas[:, LOSS] = LOSS_SIGMA + LOSS_SHARE * start.loss
    prior = noise[:, None] / sigmas**2
    pull = prior * (_values(start) - _values(banded))
    step = np.zeros_like(right)
    for band in range(len(right)):
        inner = square[band][np.ix_(active, active)].copy()
        inner[np.diag_indices_from(inner)] += prior[band, active]
        scale = np.sqrt(np.maximum(np.diag(inner), 1e-300))
        inner /= np.outer(scale, scale)
        inner[np.diag_indices_from(inner)] += damping[band] + 1e-9
        wanted = (right[band] + pull[band])[active] / scale
        step[band, active] = np.linalg.solve(inner, wanted) / scale
    step[:, :LOSS] = np.clip(step[:, :LOSS], -WALL_BOUND, WALL_BOUND)
    return step


def _active(banded: BandedRoom) -> NDArray[np.bool_]:
    active = np.ones(_columns(banded), dtype=bool)
    active[:LOSS] = np.repeat(banded.room.box.found, 2)
    if banded.listening.shape[1] > 1:
        # one of the two levels stands
        active[PATTERN + banded.emitting.shape[1]] = False
    return active


def _sigmas(banded: BandedRoom) -> FloatArray:
    sigmas = np.full(_columns(banded), PATTERN_SIGMA)
    sigmas[LOSS], sigmas[PHASE] = LOSS_SIGMA, PHASE_SIGMA
    sigmas[PATTERN + banded.emitting.shape[1] :] = HEARING_SIGMA
    return sigmas


def _moved(banded: BandedRoom, step: FloatArray) -> BandedRoom:
    values = _values(banded) + step
    walls = values[:, 0:LOSS:2] + 1j * values[:, 1:LOSS:2]
    last = PATTERN + banded.emitting.shape[1]
    return replace(
        banded,
        walls=_allowed(walls, banded.angled),
        loss=np.maximum(values[:, LOSS], 0.0),
        phase=values[:, PHASE],
        emitting=np.ascontiguousarray(values[:, PATTERN:last]),
        listening=np.ascontiguousarray(values[:, last:])
        if values.shape[1] > last
        else banded.listening,
    )


def _allowed(walls: ComplexArray, angled: bool) -> ComplexArray:
    """Return walls that give no energy: admittances to the right, factors below 1."""
    if angled:
        real = np.clip(walls.real, LEAST_ADMITTANCE, MOST_ADMITTANCE)
        imag = np.clip(walls.imag, -MOST_ADMITTANCE, MOST_ADMITTANCE)
        return real + 1j * imag
    size = np.maximum(np.abs(walls), 1e-300)
    return walls / size * np.clip(size, 1e-3, 1.0)


def _chosen(better: NDArray[np.bool_], one: BandedRoom, other: BandedRoom):
    """Return band by band the better of two rooms."""

    def pick(name: str) -> NDArray:
        first, second = getattr(one, name), getattr(other, name)
        return np.where(better.reshape(-1, *[1] * (first.ndim - 1)), first, second)

    names = ("walls", "loss", "phase", "emitting", "listening")
    return replace(one, **{name: pick(name) for name in names})
