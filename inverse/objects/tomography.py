"""Find what stands in the way of direct sounds and first reflections.

The logarithm of how much fainter a path is than it should be is a sum over the voxels
it crosses; few voxels that explain all paths are looked for (least squares, no voxel
below zero, each neper costs).
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inverse.bands.band_fit import (
    DEEP_HZ,
    KEPT_OUT,
    LEAST_ROWS,
    BandData,
    band_data,
    fit_walls,
)
from inverse.bands.banded_room import BandedRoom
from inverse.bands.occluders import Occluders, voxels_of
from inverse.rows.fitset import FitSet
from rir.arrays import FloatArray

__all__ = ["PathLosses", "find_occluders", "measure_losses", "with_occluders"]

GROUPS_HZ = ((500.0, 900.0), (1000.0, 1800.0), (2000.0, 3600.0), (4000.0, 7200.0))
"""Two half octaves each; below, sound bends round furniture (decision 0064)."""
JUDGED_ORDER, PATHS = 2, 25  # mirror paths over at most two walls: 1 + 6 + 18
FAINTEST, SURE, MODEL, UNSURE = 0.05, 3.0, 0.25, 0.25
"""Least gain, least signal over noise, and nepers the model may be wrong by."""
MOST_CROSSED = 256  # voxels of a path; what is behind is left out
EARLY_S = 0.03  # after the emission: holds these paths in rooms up to some 10 m
TURNS = 300  # of the accelerated descent, whose error falls with their square
COSTS = (0.03, 0.1, 0.3, 1.0)  # of a neper; rows kept out choose, factors of 3 suffice
MANY_ROWS = 300  # that cross most voxels; only taken where the fitted rows give a hint
HINT, WORTH = 0.97, 0.85
"""Share of the squared nepers of rows kept out that a hint, and a find, may leave: with
a box .41 to .94 and .25 to .30, without one 1.00 (decision 0064)."""
FEW = 0.02  # of the highest depth: voxels below are empty
LITTLE, SHARES = 0.0003, 3  # price of the second solution; turns of shape and levels


@dataclass(frozen=True, eq=False)
class PathLosses:
    """Hold how much fainter measured paths are than images.

    Parameters
    ----------
    nepers, weights : ndarray, shape (rays, groups)
        Minus the logarithm of the gain and one over its variance.
    rows : ndarray of int, shape (rays,)
        Row of each ray.
    cells, spans : ndarray, shape (rays, n)
        Voxels on the way, -1 behind the last, and metres in each.
    """

    nepers: FloatArray
    weights: FloatArray
    rows: NDArray[np.int64]
    cells: NDArray[np.int64]
    spans: FloatArray

    def matrix(self, voxels: int) -> Any:
        """Return metres of each ray in each voxel, sparse, shape (rays, voxels)."""
        from scipy.sparse import csr_array

        held = self.cells >= 0
        ray = np.broadcast_to(np.arange(len(self.cells))[:, None], held.shape)
        shape = len(self.cells), voxels
        return csr_array((self.spans[held], (ray[held], self.cells[held])), shape)


def measure_losses(data: BandData, banded: BandedRoom) -> PathLosses:
    """Compare direct sounds and echoes of few walls with what they should be."""
    from inverse.bands.occlusion_kernel import trace_paths

    room = banded.room
    shape, rows = voxels_of(room.box), len(data.targets)
    ways = np.zeros(rows, dtype=np.int64)
    cells = np.zeros((rows, PATHS, MOST_CROSSED), dtype=np.int64)
    spans = np.zeros((rows, PATHS, MOST_CROSSED))
    step = (room.box.high - room.box.low) / shape
    ends = room.ends(data.emitters, data.listeners)
    trace: Any = trace_paths
    bounces = np.zeros((rows, PATHS), dtype=np.int64)
    traced = ways, bounces, cells, spans
    trace(ends, banded.geometry, JUDGED_ORDER, step, shape, *traced)
    nepers, weights = _grouped(data, banded)
    # two walls are only solved for lest they colour the rest
    some = (np.arange(PATHS) < ways[:, None]) & (bounces < 2)
    ways = some.sum(axis=1)
    crossed = (cells >= 0).sum(axis=2)
    last = np.take_along_axis(cells, np.maximum(crossed - 1, 0)[..., None], axis=2)
    # devices do not stand in what stops sound
    spans[np.isin(cells, np.append(cells[:, 0, 0], last[:, 0]))] = 0.0
    longest = int(crossed.max())
    return PathLosses(
        nepers[some],
        weights[some],
        np.repeat(np.arange(rows), ways),
        cells[some][:, :longest],
        spans[some][:, :longest],
    )


def _grouped(data: BandData, banded: BandedRoom) -> tuple[FloatArray, FloatArray]:
    """Return nepers and weights of groups of bands, shape (rows, paths, groups)."""
    centers = banded.grid.centers
    kernels = banded.kernels(data.weight)
    out = []
    for low, high in GROUPS_HZ:
        mine = (centers > 0.99 * low) & (centers < 1.01 * high)
        modelled = banded.envelopes(data.emitters, data.listeners, kernels, mine)
        residual = data.targets - modelled
        total, mean = 0.0, 0.0
        for band in np.flatnonzero(mine).tolist():
            gain, sigma = _gains(data, banded, residual, band)
            weight = 1 / (np.minimum(sigma / gain, UNSURE) ** 2 + MODEL**2)
            weight = np.where(sigma < 1 / SURE, weight, 0.0)
            total, mean = total + weight, mean - weight * np.log(gain)
        mean /= np.maximum(total, 1e-300)
        out.append((mean, np.minimum(total, 1 / MODEL**2)))
    nepers, weights = np.moveaxis(np.array(out), 0, -1)
    return nepers, weights


def _gains(
    data: BandData, banded: BandedRoom, residual: NDArray[np.complex128], band: int
) -> tuple[FloatArray, FloatArray]:
    """Return the size of each path's gain in a band and its standard deviation.

    All paths of a row are solved at once; each is expected to be 1, by 1.
    """
    from inverse.bands.occlusion_kernel import part_paths

    grid = banded.grid
    first, period = int(grid.starts[band]), int(grid.lengths[band])
    early = min(round(EARLY_S * grid.sample_rate * period / grid.size) + 8, period)
    columns = np.zeros((len(residual), PATHS, early), dtype=np.complex128)
    write: Any = part_paths
    write(
        *banded.loop_input(data.emitters, data.listeners, banded.kernels(data.weight)),
        JUDGED_ORDER,
        band,
        columns,
    )
    rest = residual[:, first : first + early]
    square = np.einsum("rpt,rqt->rpq", columns.conj(), columns, optimize=True)
    right = np.einsum("rpt,rt->rp", columns.conj(), rest, optimize=True)
    noise = (np.abs(rest) ** 2).mean(axis=1)
    inverse, change = _solved_gains(square, right, noise)
    gap = rest - np.einsum("rpt,rp->rt", columns, change)
    inverse, change = _solved_gains(square, right, (np.abs(gap) ** 2).mean(axis=1))
    sigma = np.sqrt(np.real(np.einsum("rpp->rp", inverse)))
    gain = np.clip(np.abs(1 + change), np.maximum(FAINTEST, 0.5 * sigma), 2.0)
    return gain, sigma


def _solved_gains(
    square: NDArray[np.complex128], right: NDArray[np.complex128], noise: FloatArray
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Return covariances and changes of gains that are expected to change by 1."""
    noise = np.maximum(noise, 1e-300)
    whole = square / noise[:, None, None] + np.eye(PATHS)
    inverse = np.asarray(np.linalg.inv(whole), dtype=np.complex128)
    return inverse, np.einsum("rpq,rq->rp", inverse, right / noise[:, None])


def with_occluders(rows: FitSet, data: BandData, banded: BandedRoom) -> BandedRoom:
    """Return the room with what stands in the way of sound in it, if anything.

    Parameters
    ----------
    rows : FitSet
        All measured rows; many are taken where the fitted ones hint at something.
    data : BandData
        The fitted rows, their places corrected.
    banded : BandedRoom
        The room whose images predict them.
    """
    if not banded.room.box.found.all() or len(data.targets) < LEAST_ROWS:
        return banded
    if find_occluders(data, banded, HINT) is None:
        return banded
    some = band_data(rows.spread(MANY_ROWS), banded.grid, banded.source)
    found = find_occluders(some, banded, WORTH)
    if found is None:
        return banded
    # walls were taken for weaker than they are where their echoes lay in shadow
    shadows = np.zeros_like(data.targets)
    every = np.ones(banded.grid.bands, dtype=bool)
    kernels = banded.kernels(data.weight)
    taken = banded.loop_input(data.emitters, data.listeners, kernels)
    found.add(taken, banded.room.box, banded.grid.centers, every, shadows)
    lit = replace(data, targets=data.targets - shadows)
    banded, _ = fit_walls(lit, banded, 2, chosen=banded.grid.centers > DEEP_HZ)
    again = find_occluders(some, banded, WORTH)
    return replace(banded, occluders=again or found)


def find_occluders(
    data: BandData, banded: BandedRoom, worth: float = WORTH
) -> Occluders | None:
    """Return what rows kept out agree stands in the way; None where nothing does.

    Parameters
    ----------
    data : BandData
        Rows.
    banded : BandedRoom
        The room, free of occluders.
    worth : float
        Share of the squared nepers of rows kept out that may be left at most.
    """
    faint = measure_losses(data, banded)
    shape = voxels_of(banded.room.box)
    matrix = faint.matrix(int(np.prod(shape)))
    judge = faint.rows % KEPT_OUT == KEPT_OUT - 1
    fitting = np.where(judge[:, None], 0.0, faint.weights)
    judging = np.where(judge[:, None], faint.weights, 0.0)
    empty = max(float((judging * faint.nepers**2).sum()), 1e-300)
    tried = []
    for cost in COSTS:
        gap = faint.nepers - matrix @ _freed(matrix, faint.nepers, fitting, cost)
        tried.append((float((judging * gap**2).sum()) / empty, cost))
    share, cost = min(tried)
    if share > worth:
        return None
    depths = _freed(matrix, faint.nepers, faint.weights, cost)
    hertz = np.array([np.sqrt(low * high) for low, high in GROUPS_HZ])
    return Occluders(shape, hertz, np.ascontiguousarray(depths.T))


def _freed(
    matrix: Any, nepers: FloatArray, weights: FloatArray, cost: float
) -> FloatArray:
    """Return voxels at little cost where costly ones are not empty.

    All bands share one shape, each at its own level.
    """
    depths = _solved(matrix, nepers, weights, cost)
    few = depths.mean(axis=1) > FEW * depths.mean(axis=1).max(initial=0.0)
    out = np.zeros_like(depths)
    if not few.any():
        return out
    some, levels = matrix[:, few], depths[few].sum(axis=0)
    shape = np.zeros(int(few.sum()))
    for _ in range(SHARES):
        weight = (weights * levels**2).sum(axis=1)
        mean = (weights * levels * nepers).sum(axis=1) / np.maximum(weight, 1e-300)
        shape = _solved(some, mean[:, None], weight[:, None], LITTLE)
        modelled = some @ shape
        power = np.maximum((weights * modelled**2).sum(axis=0), 1e-300)
        levels = np.maximum((weights * modelled * nepers).sum(axis=0) / power, 0.0)
    out[few] = shape * levels
    return out


def _solved(
    matrix: Any, nepers: FloatArray, weights: FloatArray, cost: float
) -> FloatArray:
    """Return voxels not below zero, (voxels, groups), by accelerated descent."""
    voxels = matrix.shape[1]
    price = cost * weights.max(initial=0.0)
    steep = _steepest(matrix, weights)
    now = ahead = np.zeros((voxels, nepers.shape[1]))
    speed = 1.0
    turned = matrix.T.tocsr()
    for _ in range(TURNS):
        slope = turned @ (weights * (matrix @ ahead - nepers)) + price
        then = np.maximum(ahead - slope / steep, 0.0)
        faster = 0.5 * (1 + np.sqrt(1 + 4 * speed**2))
        ahead = then + (speed - 1) / faster * (then - now)
        now, speed = then, faster
    return now


def _steepest(matrix: Any, weights: FloatArray) -> float:
    """Return a bound of the curvature: rows times columns of the normal equations."""
    weight = weights.max(axis=1)
    return float((matrix.T @ (weight * matrix.sum(axis=1))).max()) + 1e-12
