"""Cells of a grid as walls cut them: how much air is in each, and what it touches."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray
from rooms.mesh.columns import filled_cells
from rooms.mesh.geometry import MeshGeometry

__all__ = ["CutCells", "cut_cells", "whole_cells"]

_PARTS = 3
"""Parts of a cell along each axis that are air or not: walls lie right to a sixth of a
cell. Odd, so that only air on both ends of a part that is none divides a cell."""


@dataclass(frozen=True, eq=False)
class CutCells:
    """Shares of cells, (nx + 2, ny + 2, nz + 2): a frame around them holds no air.

    Parameters
    ----------
    volume : ndarray
        Share of each cell that is air.
    openings : tuple of ndarray
        Along each axis: share of the face towards the next cell that is open.
    walls : tuple of ndarray
        Areas of walls in each cell against its faces, as `rir.room.WALLS`: facing up
        an axis, then down, for each axis.
    """

    volume: FloatArray
    openings: tuple[FloatArray, ...]
    walls: tuple[FloatArray, ...]


def whole_cells(counts: tuple[int, ...]) -> CutCells:
    """Return the cells of a box, none of them cut."""
    return _shares(np.ones(counts, dtype=bool), 1)


@lru_cache(maxsize=16)
def cut_cells(mesh: MeshGeometry, counts: tuple[int, int, int], most: int) -> CutCells:
    """Return the cells of the bounding box of a mesh, once for all emitters.

    Parameters
    ----------
    mesh : MeshGeometry
        A room.
    counts : tuple of int
        Cells along each axis.
    most : int
        Parts of cells that may be looked at; fewer than they are, cells stay whole.
    """
    divided = mesh.watertight and np.prod(counts) * _PARTS**3 <= most
    parts = _PARTS if divided else 1
    shape = parts * np.array(counts)
    size = np.asarray(mesh.size, dtype=float)
    # the triangles' corners are stated relative to the middle of the mesh
    low, spacing = -size / 2, size / shape
    if mesh.watertight:
        air = filled_cells(mesh.corners, low, spacing, shape) > 0
        return _shares(_undivided(air) if divided else air, parts)
    from rooms.kernels.grid import winding_numbers

    axes = [np.arange(n) + 0.5 for n in shape]
    middles = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1) * spacing + low
    turns = np.abs(winding_numbers(middles.reshape(-1, 3), mesh.corners))
    return _shares((turns > 0.5).reshape(tuple(shape)), parts)


def _undivided(air: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return parts of which no cell has air on both sides of a wall: one side is lost.

    A cell has one pressure, and would let through what a thin wall keeps.
    """
    air = air.copy()
    for axis in range(3):
        rows = np.moveaxis(air, axis, 0)
        first, middle, last = (rows[k::_PARTS] for k in range(_PARTS))
        last &= ~(first & ~middle)
    return air


def _shares(air: NDArray[np.bool_], parts: int) -> CutCells:
    framed = np.pad(air, parts)
    openings, walls = [], []
    for axis in range(3):
        behind, ahead = (np.roll(framed, shift, axis) for shift in (1, -1))
        walls += [
            _mean(framed & ~beside, parts, None) * parts for beside in (behind, ahead)
        ]
        openings.append(_mean(framed & ahead, parts, axis))
    return CutCells(_mean(framed, parts, None), tuple(openings), tuple(walls))


def _mean(marks: NDArray[np.bool_], parts: int, axis: int | None) -> FloatArray:
    """Return the share of marks in each cell; along an axis, of its last parts only."""
    split = [x for n in marks.shape for x in (n // parts, parts)]
    cells = marks.reshape(split)
    if axis is not None:
        cells = np.take(cells, [parts - 1], axis=2 * axis + 1)
    return cells.mean(axis=(1, 3, 5))
