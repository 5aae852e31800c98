"""Pieces of the surfaces, on which energy from two places meets."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray, IntArray
from rooms.mesh import MeshGeometry
from rooms.mesh.hierarchy import aligned

__all__ = ["Patches", "find_patches"]


_LONGEST = 3.0
"""Parts of triangles are no longer than about so many sides of a square patch."""


@dataclass(frozen=True, eq=False)
class Patches:
    """Parts of triangles, or groups of small triangles, each lit from one side.

    Parameters
    ----------
    first : ndarray, shape (F, 2)
        First patch of each triangle, seen against its normal and along it.
    parts : ndarray, shape (F, 2)
        Into how many parts both sides at its first corner are cut.
    whole : ndarray of bool, shape (F,)
        Whether it is half of a parallelogram, which it stands for.
    corner, across : ndarray, shape (F, 3), (F, 2, 3)
        The first corner [m], and vectors whose products with a point's distance
        from it tell along how many parts of either side the point lies.
    area : ndarray, shape (P,)
        Area of each patch [m²].
    surface : ndarray, shape (P,)
        Row of materials of each patch.
    """

    first: IntArray
    parts: IntArray
    whole: NDArray[np.bool_]
    corner: FloatArray
    across: FloatArray
    area: FloatArray
    surface: IntArray

    def __len__(self) -> int:
        return len(self.area)

    def records(self, geometry: MeshGeometry) -> FloatArray:
        """Return what a ray asks of the triangle it meets, shape (F, 16).

        Normal and surface; first patches, parts (0 for one patch), and minus parts if
        it is half of a parallelogram; then how many parts along either side a point
        lies, as plane and offset. All in two lines of the cache.
        """
        pieces = self.parts.prod(axis=1) > 1
        wide, deep = (self.parts * pieces[:, None]).T
        offset = -np.einsum("fsk,fk->fs", self.across, self.corner)
        columns = [
            geometry.tables.planes[:, :3],
            geometry.face_surface[:, None],
            self.first,
            wide[:, None],
            np.where(self.whole, -deep, deep)[:, None],
            np.dstack([self.across, offset]).reshape(-1, 8),
        ]
        return aligned(np.concatenate(columns, axis=1, dtype=float))


def find_patches(geometry: MeshGeometry, count: int) -> Patches:
    """Cut the surfaces of a mesh into about `count` patches.

    Large triangles and parallelograms are cut into equal ones; small ones that lie
    close together and face the same way share a patch. Both sides of a triangle
    count where both can be lit.
    """
    corners, whole = geometry.pairs
    one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    plane = np.cross(one, other)
    square = np.einsum("fk,fk->f", plane, plane)
    area = np.sqrt(square) * np.where(whole, 1.0, 0.5)
    piece = np.sqrt(float(area.sum()) / max(count, 1))
    sides = np.stack([np.linalg.norm(v, axis=1) for v in (one, other)], axis=1)
    parts = np.maximum(1, np.rint(sides / piece)).astype(np.int64)
    # a triangle is cut into the square of a number of triangles like itself
    even = np.maximum(np.sqrt(area) / piece, sides.max(axis=1) / (_LONGEST * piece))
    cuts = np.maximum(1, np.rint(even)).astype(np.int64)[:, None]
    parts = np.where(whole[:, None], parts, cuts)
    across = np.stack([np.cross(other, plane), np.cross(plane, one)], axis=1)
    across *= (parts / np.maximum(square, 1e-300)[:, None])[..., None]
    numbers = _numbered(geometry, parts, area, np.sqrt(2) * piece)
    first, areas, surface = numbers
    return Patches(
        first, parts, whole, np.ascontiguousarray(corners[:, 0]), across, areas, surface
    )


def _numbered(
    geometry: MeshGeometry, parts: IntArray, area: FloatArray, cell: float
) -> tuple[IntArray, FloatArray, IntArray]:
    """Return the first patch of each triangle's sides; areas and surfaces of all."""
    both = ~geometry.panels.sided[geometry.panels.of_face]
    first, pieces = np.zeros((len(parts), 2), dtype=np.int64), parts.prod(axis=1)
    cut = np.nonzero((pieces > 1) & (area > 0))[0]
    lit = np.where(both[cut], 2, 1)
    ends = np.cumsum(lit * pieces[cut])
    first[cut, 0] = ends - lit * pieces[cut]
    first[cut, 1] = ends - pieces[cut]
    count = int(ends[-1]) if len(ends) else 0
    areas = np.repeat(area[cut] / pieces[cut], lit * pieces[cut])
    surface = np.repeat(geometry.face_surface[cut], lit * pieces[cut])
    small = np.nonzero((pieces == 1) & (area > 0))[0]
    if not len(small):
        return first, areas, surface
    # the second side of a triangle of which only one is lit is the first
    keys = [
        _keys(geometry, small, cell, np.where(both[small], side, 0)) for side in (0, 1)
    ]
    index = _groups(np.concatenate(keys)).reshape(2, -1)
    groups = int(index.max(initial=-1)) + 1
    summed, row = np.zeros(groups), np.zeros(groups, dtype=np.int64)
    for side in (0, 1):
        counts = both[small] | (side == 0)
        np.add.at(summed, index[side][counts], area[small][counts])
        row[index[side]] = geometry.face_surface[small]
        first[small, side] = count + index[side]
    return first, np.concatenate([areas, summed]), np.concatenate([surface, row])


def _groups(keys: IntArray) -> IntArray:
    """Return the number of each row among the different rows, in their order."""
    number = np.zeros(len(keys), dtype=np.int64)
    for column in keys.T:
        # one number at a time, so that none grows too large
        _, part = np.unique(column, return_inverse=True)
        _, number = np.unique(number * (part.max() + 1) + part, return_inverse=True)
    return number


def _keys(
    geometry: MeshGeometry, faces: IntArray, cell: float, side: IntArray
) -> IntArray:
    """Return what triangles of one patch have in common, shape (n, 6)."""
    normal = geometry.tables.planes[faces, :3]
    # seen from its other side a triangle faces the other way
    normal = np.where(side[:, None] == 1, -normal, normal)
    axis = np.abs(normal).argmax(axis=1)
    ahead = np.sign(np.take_along_axis(normal, axis[:, None], axis=1)[:, 0])
    place = np.floor(geometry.corners[faces].mean(axis=1) / cell).astype(np.int64)
    kind = np.column_stack([geometry.face_surface[faces], axis, ahead.astype(np.int64)])
    return np.column_stack([kind, place])
