"""A tree of boxes, sixteen to a node, around the triangles of a mesh."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray, IntArray

__all__ = ["Hierarchy", "aligned", "build_hierarchy"]

_WIDTH, _PACK = 16, 8  # boxes and triangles tested at once, as `lanes` does
_LINE = 64  # bytes of a line of the cache


@dataclass(frozen=True, eq=False)
class Hierarchy:
    """Boxes and triangles, laid out for `rooms.mesh.lanes`."""

    nodes: NDArray[np.float32]
    """Low and high corners of the boxes per node [m]. Shape (N, 6, 16), float32."""
    children: IntArray
    """Node behind each box, or -1 - pack. Shape (N, 16)."""
    packs: FloatArray
    """Eight triangles each: plane, barycentric coordinates, and whether it is one.
    Shape (M, 13, 8)."""
    faces: IntArray
    """Index of each triangle, -1 for none. Shape (M, 8)."""

    @property
    def arrays(self) -> tuple[NDArray[np.float32], IntArray, FloatArray, IntArray]:
        """The four arrays, as compiled loops take them."""
        return self.nodes, self.children, self.packs, self.faces


def build_hierarchy(
    corners: FloatArray, doubled: NDArray[np.bool_], slack: float
) -> Hierarchy:
    """Build the tree over triangles, shape (F, 3, 3), by the surface-area rule.

    Those that are `doubled`, shape (F,), stand for the parallelogram on their first
    corner; triangles without an area are left out. Boxes grow by `slack` [m], so that
    single precision loses no triangle.

    References
    ----------
    J. Goldsmith, J. Salmon, IEEE Comput. Graph. Appl. 7(5), 14 (1987).
    """
    from rooms.mesh.split import best_split

    fourth = np.where(
        doubled[:, None], corners[:, 1] + corners[:, 2] - corners[:, 0], corners[:, 0]
    )
    shape = np.concatenate([corners, fourth[:, None]], axis=1)
    low, high = shape.min(axis=1) - slack, shape.max(axis=1) + slack
    middle = (low + high) / 2
    nodes, children, faces = [], [], []
    waiting = [np.nonzero(np.any(corners[:, 0] != corners[:, 1], axis=1))[0]]
    while waiting:
        groups = [waiting.pop(0)]
        while len(groups) < _WIDTH:
            large = [k for k, g in enumerate(groups) if len(g) > _PACK]
            if not large:
                break
            pick = max(large, key=lambda k: _half_area(low, high, groups[k]))
            group = groups.pop(pick)
            order, cut = best_split(low, high, middle, group)
            groups += [order[:cut], order[cut:]]
        box = np.full((6, _WIDTH), np.inf)
        box[3:] = -np.inf
        links = np.full(_WIDTH, -1)
        # nodes are numbered in the order in which they wait
        for lane, group in enumerate(groups):
            box[:3, lane] = low[group].min(axis=0)
            box[3:, lane] = high[group].max(axis=0)
            if len(group) > _PACK:
                links[lane] = len(nodes) + 1 + len(waiting)
                waiting.append(group)
            else:
                links[lane] = -1 - len(faces)
                faces.append(np.pad(group, (0, _PACK - len(group)), constant_values=-1))
        nodes.append(box)
        children.append(links)
    members = np.array(faces)
    return Hierarchy(
        aligned(np.array(nodes).astype(np.float32)),
        np.array(children),
        aligned(_packed(corners, doubled, members)),
        members,
    )


def aligned(array: NDArray[Any]) -> NDArray[Any]:
    """Return a copy of which no row of 64 bytes lies on two lines of the cache."""
    room = np.empty(array.nbytes + _LINE, dtype=np.uint8)
    start = -room.ctypes.data % _LINE
    copy = room[start : start + array.nbytes].view(array.dtype).reshape(array.shape)
    copy[...] = array
    return copy


def _half_area(low: FloatArray, high: FloatArray, group: IntArray) -> float:
    x, y, z = high[group].max(axis=0) - low[group].min(axis=0)
    return float(x * y + y * z + z * x)


def _packed(
    corners: FloatArray, doubled: NDArray[np.bool_], members: IntArray
) -> FloatArray:
    a, b, c = np.moveaxis(corners, 1, 0)
    one, other = b - a, c - a
    normal = np.cross(one, other)
    square = np.einsum("ij,ij->i", normal, normal)[:, None]
    square[square == 0] = 1.0
    u, v = np.cross(other, normal) / square, np.cross(normal, one) / square
    rows = [
        normal,
        np.einsum("ij,ij->i", normal, a)[:, None],
        u,
        -np.einsum("ij,ij->i", u, a)[:, None],
        v,
        -np.einsum("ij,ij->i", v, a)[:, None],
        np.where(doubled, 0.0, 1.0)[:, None],
    ]
    # a lane without a triangle: its plane is never met
    none = np.zeros((1, 13))
    none[0, 3] = np.inf
    table = np.concatenate([np.concatenate(rows, axis=1), none])
    return np.ascontiguousarray(np.moveaxis(table[members], 1, 2))
