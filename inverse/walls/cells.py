"""Cut a box of space into cells by planes, and say which cells hold air."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inverse.paths.polyhedron import Polyhedron
from rir.arrays import BoolArray, FloatArray

__all__ = ["Cell", "cut_cells", "enclosed", "label_cells", "shape_of"]

SLIVER = 1e-6  # square metres: a cut this small is rounding, not a border
UNIT = 1000.0  # flows are whole numbers: prices count in thousandths of a square metre
SURE = 1e7  # price of what must not happen: more than all walls of a house
INSIDE_PRICE = 0.2
"""Price of a cubic metre of air that no path crosses, in square metres of wall. Dearer,
nooks are walled off; cheaper, space behind faint walls is taken in."""


@dataclass(frozen=True, eq=False)
class Cell:
    """Hold a convex piece of space."""

    sides: tuple[int, ...]
    """1 where the cell lies in front of a plane, -1 behind, one a plane."""
    faces: dict[int, FloatArray]
    """Polygon, shape (n, 3), by number of plane; below 0 on the bounds."""

    @property
    def center(self) -> FloatArray:
        """Mean of the corners."""
        return np.concatenate(list(self.faces.values())).mean(axis=0)

    @property
    def volume(self) -> float:
        """Cubic metres."""
        middle, total = self.center, 0.0
        for polygon in self.faces.values():
            area, normal = _area_vector(polygon)
            total += area * abs(normal @ (polygon[0] - middle)) / 3
        return total


def cut_cells(planes: FloatArray, low: FloatArray, high: FloatArray) -> list[Cell]:
    """Cut a box of space by planes (P, 4), normal and offset."""
    cells = [Cell((), _bounds(low, high))]
    for number, plane in enumerate(planes):
        made = []
        for cell in cells:
            made += _split(cell, number, plane)
        cells = made
    return cells


def _bounds(low: FloatArray, high: FloatArray) -> dict[int, FloatArray]:
    faces = {}
    for axis in range(3):
        for side, value in enumerate((low[axis], high[axis])):
            square = np.empty((4, 3))
            one, other = (axis + 1) % 3, (axis + 2) % 3
            square[:, axis] = value
            square[:, one] = [low[one], high[one], high[one], low[one]]
            square[:, other] = [low[other], low[other], high[other], high[other]]
            faces[-1 - (2 * axis + side)] = square
    return faces


def _split(cell: Cell, number: int, plane: FloatArray) -> list[Cell]:
    parts: list[dict[int, FloatArray]] = [{}, {}]
    rim: list[FloatArray] = []
    for key, polygon in cell.faces.items():
        heights = polygon @ plane[:3] - plane[3]
        for part, sign in zip(parts, (1, -1), strict=True):
            kept = _clipped(polygon, sign * heights)
            if len(kept) >= 3:
                part[key] = kept
        crossing = (heights > 0) != (np.roll(heights, -1) > 0)
        after = np.roll(polygon, -1, axis=0)
        share = heights / np.where(crossing, heights - np.roll(heights, -1), 1.0)
        rim += list((polygon + share[:, None] * (after - polygon))[crossing])
    cap = _ordered(np.array(rim), plane[:3]) if len(rim) >= 3 else np.empty((0, 3))
    if len(cap) < 3 or _area_vector(cap)[0] < SLIVER:
        side = 1 if cell.center @ plane[:3] > plane[3] else -1
        return [Cell((*cell.sides, side), cell.faces)]
    return [
        Cell((*cell.sides, sign), {**part, number: cap})
        for part, sign in zip(parts, (1, -1), strict=True)
    ]


def _clipped(polygon: FloatArray, heights: FloatArray) -> FloatArray:
    """Keep the part of a polygon with positive heights."""
    kept = []
    for k in range(len(polygon)):
        here, there = heights[k], heights[(k + 1) % len(polygon)]
        if here > 0:
            kept.append(polygon[k])
        if (here > 0) != (there > 0):
            step = polygon[(k + 1) % len(polygon)] - polygon[k]
            kept.append(polygon[k] + here / (here - there) * step)
    return np.array(kept).reshape(-1, 3)


def _ordered(points: FloatArray, normal: FloatArray) -> FloatArray:
    """Return points of a plane in order round their middle, each once."""
    gap = points - points.mean(axis=0)
    first = gap[int(np.argmax(np.linalg.norm(gap, axis=1)))]
    first = first / max(float(np.linalg.norm(first)), 1e-12)
    second = np.cross(normal, first)
    order = np.argsort(np.arctan2(gap @ second, gap @ first))
    points = points[order]
    apart = np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1) > 1e-7
    return points[apart]


def _area_vector(polygon: FloatArray) -> tuple[float, FloatArray]:
    total = np.zeros(3)
    for k in range(1, len(polygon) - 1):
        total += np.cross(polygon[k] - polygon[0], polygon[k + 1] - polygon[0])
    size = float(np.linalg.norm(total))
    return size / 2, total / max(size, 1e-300)


def enclosed(
    cells: list[Cell], planes: FloatArray, points: FloatArray
) -> NDArray[np.int64]:
    """Return the number of each point's cell, shape (points,)."""
    number = {cell.sides: k for k, cell in enumerate(cells)}
    heights = points @ planes[:, :3].T - planes[:, 3]
    sides = np.where(heights > 0, 1, -1)
    held = [number.get(tuple(row), -1) for row in sides.tolist()]
    return np.array(held, dtype=np.int64)


def label_cells(cells: list[Cell], air: BoolArray, support: FloatArray) -> BoolArray:
    """Return which cells hold air: a cheapest cut between air and the outside.

    Parameters
    ----------
    cells : list of Cell
        As cut.
    air : ndarray of bool, shape (cells,)
        Cells known to hold air.
    support : ndarray, shape (cells, P)
        0 to 1: how much of a wall was heard on the face of a cell in each plane.

    Notes
    -----
    A border costs its area where no wall was heard; air that nobody has heard of
    costs its volume. Cells on the bounds of space lie outside.
    """
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import breadth_first_order, maximum_flow

    count = len(cells)
    links: dict[tuple[int, int], float] = {}
    source, sink = count, count + 1
    number = {cell.sides: k for k, cell in enumerate(cells)}
    for k, cell in enumerate(cells):
        open_end = any(plane < 0 for plane in cell.faces)
        links[k, sink] = SURE if open_end else UNIT * INSIDE_PRICE * cell.volume
        if air[k]:
            links[source, k] = 10 * SURE
        for plane, polygon in cell.faces.items():
            other = number.get(_across(cell.sides, plane)) if plane >= 0 else None
            if other is None:
                continue
            known = max(support[k, plane], support[other, plane])
            price = _area_vector(polygon)[0] * max(1 - known, 0.02)
            links[k, other] = links[other, k] = UNIT * price
    rows, columns = np.array(list(links)).T
    values = np.maximum(np.round(list(links.values())), 1).astype(np.int32)
    graph = csr_matrix((values, (rows, columns)), shape=(count + 2, count + 2))
    flow = maximum_flow(graph, source, sink).flow
    residual = graph - flow
    residual.data = np.maximum(residual.data, 0)
    residual.eliminate_zeros()
    reached = breadth_first_order(residual, source, return_predecessors=False)
    label = np.zeros(count + 2, dtype=bool)
    label[reached] = True
    return label[:count]


def _across(sides: tuple[int, ...], plane: int) -> tuple[int, ...]:
    return (*sides[:plane], -sides[plane], *sides[plane + 1 :])


def shape_of(
    cells: list[Cell], inside: BoolArray, planes: FloatArray
) -> Polyhedron | None:
    """Return the walls between air and the rest; None if there are none.

    A plane that is met from both sides becomes two, one facing each way.
    """
    number = {cell.sides: k for k, cell in enumerate(cells)}
    walls: dict[tuple[int, int], int] = {}
    rows, corners, owner = [], [], []
    for k in np.flatnonzero(inside).tolist():
        cell = cells[k]
        for plane, polygon in cell.faces.items():
            other = number.get(_across(cell.sides, plane)) if plane >= 0 else None
            if plane < 0 or (other is not None and inside[other]):
                continue
            key = plane, cell.sides[plane]
            if key not in walls:
                walls[key] = len(walls)
                rows.append(planes[plane] * cell.sides[plane])
            for j in range(1, len(polygon) - 1):
                corners.append(polygon[[0, j, j + 1]])
                owner.append(walls[key])
    if not rows:
        return None
    flat = np.concatenate(corners)
    rounded = np.round(flat, 6)
    _, first, faces = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
    return Polyhedron(
        np.array(rows), flat[first], faces.reshape(-1, 3).astype(np.int64),
        np.array(owner, dtype=np.int64),
    )  # fmt: skip
