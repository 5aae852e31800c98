"""Fit geometry and the places of rows to their half octaves.

Each row has three coordinates at both ends, known to a stated sigma; they are
eliminated row by row, so that rows cost the same however many there are.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inverse.bands.band_fit import BandData
from inverse.bands.banded_room import BandedRoom, most_images
from inverse.bands.half_octaves import SPARE
from inverse.paths.lattice_kernel import GEOMETRY
from rir import Poses
from rir.arrays import FloatArray

__all__ = ["PlaceFit", "fit_places"]

PLACES = 6  # coordinates of a row's two ends
SIGMAS = np.array([0.02] * 3 + [0.05] * 6 + [2.0, 8.0])
"""Weak priors: radians, metres, metres per second, samples."""
FARTHEST = 3.0
"""A place moves by this many of its sigmas in one step at most."""


@dataclass(frozen=True, eq=False)
class PlaceFit:
    """Hold what moved and how well it is known."""

    banded: BandedRoom
    """With its geometry moved."""
    data: BandData
    """With its places moved."""
    shifts: FloatArray
    """Of listener and emitter in the frame of the box, metres. Shape (rows, 6)."""
    covariance: FloatArray
    """Of turn, low, high, speed of sound and latency in samples. Shape (11, 11)."""


def fit_places(
    data: BandData,
    banded: BandedRoom,
    chosen: NDArray[np.bool_],
    turns: int,
    sigma: float,
    shifts: FloatArray | None = None,
) -> PlaceFit:
    """Move geometry and places by the `chosen` bands.

    Parameters
    ----------
    data : BandData
        Rows; their places already hold `shifts`.
    sigma : float
        Standard deviation of each stated coordinate, metres.
    shifts : ndarray, shape (rows, 6), optional
        How far places have been moved before.
    """
    rows = len(data.targets)
    shifts = np.zeros((rows, PLACES)) if shifts is None else shifts
    best = PlaceFit(banded, data, shifts, np.zeros((GEOMETRY, GEOMETRY)))
    noise = _noise(best, chosen)
    square, right, misfit = _sums(best, chosen, 1 / noise)
    lowest, damping = _cost(best, misfit, sigma), 1e-3
    for turn in range(turns):
        last = turn == turns - 1
        step, moves, covariance = _solved(square, right, best, sigma, damping)
        best = replace(best, covariance=covariance)
        tried = _moved(best, step, moves)
        _, pull, misfit = _sums(tried, chosen, 1 / noise, curved=False, sloped=not last)
        cost = _cost(tried, misfit, sigma)
        if cost < lowest:
            best, lowest, damping = tried, cost, damping / 5
            right = pull
        else:
            damping *= 20
    return best


def _cost(at: PlaceFit, misfit: FloatArray, sigma: float) -> float:
    return float(misfit.sum() + (at.shifts**2).sum() / max(sigma, 1e-9) ** 2)


def _noise(at: PlaceFit, chosen: NDArray[np.bool_]) -> FloatArray:
    """Return what one envelope sample misses on average, shape (rows, bands)."""
    grid = at.banded.grid
    kernels = at.banded.kernels(at.data.weight)
    model = at.banded.envelopes(at.data.emitters, at.data.listeners, kernels)
    gap = np.abs(at.data.targets - model) ** 2 * at.data.live
    residual = np.add.reduceat(gap, grid.starts, axis=1)
    count = np.add.reduceat(at.data.live.astype(float), grid.starts)
    pooled = residual.sum(axis=0) / np.maximum(at.data.power.sum(axis=0), 1e-300)
    # rows are believed alike, by their own energy and the band's share
    noise = at.data.power * pooled / np.maximum(count, 1)
    return np.maximum(noise, 1e-6 * noise[:, chosen].mean() + 1e-300)


def _sums(
    at: PlaceFit,
    chosen: NDArray[np.bool_],
    weights: FloatArray,
    *,
    curved: bool = True,
    sloped: bool = True,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    from inverse.bands.place_sums import accumulate_places

    banded, data = at.banded, at.data
    rows, columns = len(weights), GEOMETRY + PLACES
    square, right = np.zeros((rows, columns, columns)), np.zeros((rows, columns))
    misfit = np.zeros(rows)
    add: Any = accumulate_places
    add(
        *banded.loop_input(data.emitters, data.listeners, banded.kernels(data.weight)),
        most_images(banded),
        data.live,
        chosen,
        curved,
        sloped,
        np.zeros(3),
        banded.room.speed_of_sound,
        banded.room.sample_rate,
        data.targets,
        # envelopes hold fewer independent samples than they have
        2 / SPARE * weights,
        square,
        right,
        misfit,
    )
    return square, right, misfit


def _solved(
    square: FloatArray, right: FloatArray, at: PlaceFit, sigma: float, damping: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the step of the geometry, of all places, and a covariance."""
    found = at.banded.room.box.found
    active = np.ones(GEOMETRY, dtype=bool)
    active[:3] = found.sum() >= 2
    active[3:6], active[6:9] = found[0::2], found[1::2]
    outer = square[:, :GEOMETRY, :GEOMETRY].sum(axis=0)
    pull = right[:, :GEOMETRY].sum(axis=0)
    moves = np.zeros((len(square), PLACES))
    solved = np.zeros((len(square), PLACES, GEOMETRY + 1))
    if sigma > 0:
        inner = square[:, GEOMETRY:, GEOMETRY:] + np.eye(PLACES) / sigma**2
        cross = square[:, GEOMETRY:, :GEOMETRY]
        wanted = right[:, GEOMETRY:] - at.shifts / sigma**2
        both = np.concatenate([cross, wanted[..., None]], axis=2)
        solved = np.linalg.solve(inner, both)
        outer = outer - np.einsum("nij,nik->jk", cross, solved[..., :-1])
        pull = pull - np.einsum("nij,ni->j", cross, solved[..., -1])
    outer = outer + np.diag(1 / SIGMAS**2)
    kept = outer[np.ix_(active, active)]
    covariance = np.zeros((GEOMETRY, GEOMETRY))
    covariance[np.ix_(active, active)] = np.linalg.pinv(kept)
    damped = kept + np.diag(damping * np.diag(kept))
    step = np.zeros(GEOMETRY)
    step[active] = np.linalg.solve(damped, pull[active])
    if sigma > 0:
        moves = solved[..., -1] - np.einsum("nij,j->ni", solved[..., :-1], step)
        moves = np.clip(moves, -FARTHEST * sigma, FARTHEST * sigma)
    return step, moves, covariance


def _moved(at: PlaceFit, step: FloatArray, moves: FloatArray) -> PlaceFit:
    room = at.banded.room
    turned = room.box.turned(step[:3])
    box = replace(turned, low=turned.low + step[3:6], high=turned.high + step[6:9])
    room = replace(
        room,
        shape=box,
        speed_of_sound=room.speed_of_sound + float(step[9]),
        latency_s=room.latency_s + float(step[10]) / room.sample_rate,
    )
    data = at.data.moved(
        _shifted(at.data.emitters, moves[:, 3:] @ box.axes),
        _shifted(at.data.listeners, moves[:, :3] @ box.axes),
    )
    return PlaceFit(
        replace(at.banded, room=room), data, at.shifts + moves, at.covariance
    )


def _shifted(poses: Poses, moves: FloatArray) -> Poses:
    return Poses(poses.positions + moves, poses.orientations)
