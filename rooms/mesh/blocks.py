"""A box with boxes standing in it, as triangles that enclose the air."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rir.arrays import FloatArray, IntArray
from rir.errors import SceneError
from rooms.mesh.polygon import cut_ears

__all__ = ["box_with_blocks"]

_NEAR = 1e-3
"""Faces closer than this [m] lie in one plane: sound does not get between them."""


def box_with_blocks(
    size: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, IntArray, IntArray]:
    """Return vertices, triangles and the owner of each triangle.

    Only what touches air is kept: neither the foot of a block on the floor nor the
    wall behind it, nor anything inside two blocks that overlap. Triangles meet along
    whole sides, and their normals point into the air.

    Parameters
    ----------
    size : ndarray, shape (3,)
        Lengths of the room [m]; a corner lies at the origin.
    low, high : ndarray, shape (blocks, 3)
        Corners of the blocks [m].

    Returns
    -------
    vertices : ndarray, shape (V, 3)
        Corners [m].
    faces : ndarray, shape (F, 3)
        Vertex indices.
    owner : ndarray, shape (F,)
        Wall in the order of `rir.room.WALLS`, or 6 and the number of the block.

    Raises
    ------
    SceneError
        If the blocks leave no air.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0]]), np.array([[1.0, 1, 1]])
    >>> vertices, faces, owner = box_with_blocks(np.array([4.0, 3, 2]), *corners)
    >>> np.unique(owner).tolist()
    [0, 1, 2, 3, 4, 5, 6]
    """
    planes = [
        _planes(size[k], np.concatenate([low[:, k], high[:, k]])) for k in range(3)
    ]
    cells = _cells(planes, low, high)
    if not np.any(cells == 0):
        raise SceneError("furniture fills the whole room: no air is left")
    plates = [
        plate
        for axis in range(3)
        for ahead in (False, True)
        for plate in _plates(cells, axis, ahead)
    ]
    places = np.unique(np.concatenate([p.corners for p in plates]), axis=0)
    vertices = np.stack([planes[k][places[:, k]] for k in range(3)], axis=1)
    parts = [_triangles(plate, places, vertices) for plate in plates]
    owners = np.repeat([p.owner for p in plates], [len(part) for part in parts])
    return vertices, np.concatenate(parts), owners


def _planes(length: float, ends: FloatArray) -> FloatArray:
    """Return where blocks begin and end along one axis, and the two walls [m]."""
    kept = [0.0, float(length)]
    for end in np.sort(ends):
        if min(abs(end - other) for other in kept) > _NEAR:
            kept.append(float(end))
    return np.sort(kept)


def _cells(planes: list[FloatArray], low: FloatArray, high: FloatArray) -> IntArray:
    """Return 0 for cells of air and 1 + block for solid ones, later blocks on top."""
    cells = np.zeros([len(p) - 1 for p in planes], dtype=np.int64)
    middles = [(p[1:] + p[:-1]) / 2 for p in planes]
    for block, (a, b) in enumerate(zip(low, high, strict=True)):
        inside = [(m > a[k]) & (m < b[k]) for k, m in enumerate(middles)]
        cells[np.ix_(*inside)] = 1 + block
    return cells


@dataclass(frozen=True, eq=False)
class _Plate:
    """A rectangle of cell sides that belong to one owner."""

    axis: int
    """Axis it stands across."""
    ahead: bool
    """Whether the air lies before it, seen along the axis."""
    owner: int
    """Wall, or 6 and the number of the block."""
    corners: IntArray
    """Numbers of planes, in order around it. Shape (4, 3)."""


def _plates(cells: IntArray, axis: int, ahead: bool) -> Iterator[_Plate]:
    """Yield rectangles that cover where air meets something, behind or ahead."""
    wide = [(0, 0)] * 3
    wide[axis] = (0, 1) if ahead else (1, 0)
    padded = np.pad(cells, wide, constant_values=-1)
    beside = np.take(padded, np.arange(cells.shape[axis]) + int(ahead), axis=axis)
    met = np.where((cells == 0) & (beside != 0), beside, 0)
    # a cyclic order of axes keeps the sense of a turn
    for level, layer in enumerate(np.transpose(met, np.roll(range(3), -axis))):
        for u, v, owner in _rectangles(layer.copy()):
            corners = np.empty((4, 3), dtype=np.int64)
            corners[:, axis] = level + int(ahead)
            corners[:, (axis + 1) % 3] = [u[0], u[1], u[1], u[0]]
            corners[:, (axis + 2) % 3] = [v[0], v[0], v[1], v[1]]
            wall = 2 * axis + int(ahead)
            yield _Plate(axis, ahead, wall if owner < 0 else 5 + owner, corners)


def _rectangles(
    layer: IntArray,
) -> Iterator[tuple[tuple[int, int], tuple[int, int], int]]:
    """Yield ranges along both axes and the number of equal cells; zeros are left."""
    for u, v in np.argwhere(layer):
        owner = int(layer[u, v])
        if owner == 0:
            continue
        row = layer[u, v:] == owner
        far = v + (len(row) if row.all() else int(np.argmin(row)))
        full = np.all(layer[u:, v:far] == owner, axis=1)
        last = u + (len(full) if full.all() else int(np.argmin(full)))
        layer[u:last, v:far] = 0
        yield (int(u), int(last)), (int(v), int(far)), owner


def _triangles(plate: _Plate, places: IntArray, vertices: FloatArray) -> IntArray:
    """Return vertex numbers (n, 3) that fill a plate, meeting all on its rim."""
    plane = places[:, plate.axis] == plate.corners[0, plate.axis]
    rim = []
    for a, b in zip(plate.corners, np.roll(plate.corners, -1, axis=0), strict=True):
        along = int(np.argmax(a != b))
        across = 3 - plate.axis - along
        between = np.sort([a[along], b[along]])
        on = plane & (places[:, across] == a[across])
        on &= (places[:, along] >= between[0]) & (places[:, along] <= between[1])
        found = np.nonzero(on & np.any(places != b, axis=1))[0]
        order = np.argsort(places[found, along])
        rim.append(found[order if a[along] < b[along] else order[::-1]])
    ring = np.concatenate(rim)
    flat = vertices[ring][:, [(plate.axis + 1) % 3, (plate.axis + 2) % 3]]
    ears = ring[cut_ears(flat)[1]]
    return ears[:, ::-1] if plate.ahead else ears
