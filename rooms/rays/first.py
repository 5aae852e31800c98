"""Energy that reaches a place from another by one scattering and nothing else.

Patches are too wide for it where both places are close to a surface. So the points
that the rays of both meet first are joined to the other place. A point stands for
the share of the surface that the rays of both ends leave to it (balance heuristic):
with the distance d and the cosine c towards either end, 4 scattered (1 - absorption)
/ (d² / c + d'² / c') over the number of rays, which has no pole.

E. Veach, PhD thesis, Stanford University, 1997, chapter 9.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit

from rir.arrays import FloatArray, IntArray
from rooms.mesh.hits import DEPTH, FEW, is_free
from rooms.rays.bounces import CLOSEST

__all__ = ["Hits", "find_blurred", "find_joined"]


@dataclass(frozen=True, eq=False)
class Hits:
    """What the rays of a place meet first.

    Parameters
    ----------
    origin : ndarray, shape (3,)
        The place [m].
    ways : ndarray, shape (batches, rays, 3)
        Directions of the rays.
    face, patch : ndarray, shape (batches, rays)
        Triangle and patch, -1 for none.
    length : ndarray, shape (batches, rays)
        Distance [m].
    mirrored : int
        So many rays of each batch, the first, follow mirrors only.
    """

    origin: FloatArray
    ways: FloatArray
    face: IntArray
    patch: IntArray
    length: FloatArray
    mirrored: int

    @staticmethod
    def none(origin: FloatArray, ways: FloatArray, mirrored: int) -> "Hits":
        """Return room for hits."""
        shape = ways.shape[:2]
        face, patch = np.full((2, *shape), -1)
        return Hits(origin, ways, face, patch, np.zeros(shape), mirrored)

    @property
    def first(self) -> tuple[IntArray, IntArray]:
        """Hits of the rays that follow mirrors only, patch by patch.

        Patches and lengths are in the order of the returned first array, which holds
        batch and ray in one number.
        """
        patch = self.patch[:, : self.mirrored].ravel()
        order = np.argsort(patch, kind="stable")
        return order[np.searchsorted(patch[order], 0) :], patch


def find_joined(
    room: tuple[Any, ...],
    share: FloatArray,
    here: Hits,
    there: Hits,
    per_bin: float,
    bins: int,
) -> FloatArray:
    """Return the energy of one scattering, shape (batches, bins, bands).

    Parameters
    ----------
    room : tuple
        Tree, panels of faces, planes, surfaces of faces, and slack [m].
    share : ndarray, shape (surfaces, classes, bands)
        Share of the energy arriving that is scattered, in equal classes of the cosine
        of incidence: the mean of both ends' angles counts.
    here, there : Hits
        Those of both places.
    per_bin : float
        Time steps per metre.
    bins : int
        Number of time steps.
    """
    shape = (len(here.ways), bins, share.shape[2])
    rows = np.zeros((2, *shape))
    for one, other, target in ((here, there, rows[0]), (there, here, rows[1])):
        hits = one.origin, one.ways, one.face, one.length
        _join(room, share, hits, other.origin, per_bin, target)
    return rows[0] + rows[1]


@njit(cache=True, nogil=True)
def _join(room, share, hits, other, per_bin, rows):
    tree, of_face, planes, surface, slack = room
    nodes, children, packs, faces = tree
    origin, ways, face, length = hits
    batches, bins, bands = rows.shape
    classes = share.shape[1]
    stack, near = np.empty(DEPTH, dtype=np.int64), np.empty(16, dtype=np.float32)
    far, point = np.empty(8 * FEW), np.empty(3)
    for k in range(batches):
        count = ways.shape[1]
        for r in range(count):
            at = face[k, r]
            if at < 0:
                continue
            far_off, near_by, ahead = 0.0, 0.0, 0.0
            for axis in range(3):
                way = ways[k, r, axis]
                point[axis] = origin[axis] + length[k, r] * way
                gap = other[axis] - point[axis]
                far_off += gap * gap
                near_by += gap * planes[at, axis]
                ahead -= way * planes[at, axis]
            if near_by * ahead <= 0.0:
                continue
            span = np.sqrt(far_off)
            step = int((length[k, r] + span) * per_bin)
            row = surface[at]
            if step >= bins:
                continue
            panel = of_face[at]
            if not is_free(
                nodes,
                children,
                packs,
                faces,
                of_face,
                point,
                other,
                panel,
                panel,
                slack,
                stack,
                near,
                far,
            ):
                continue
            square = length[k, r] * length[k, r]
            weight = max(square / abs(ahead), CLOSEST)
            weight += max(far_off * span / abs(near_by), CLOSEST)
            one = min(int(abs(ahead) * classes), classes - 1)
            two = min(int(abs(near_by) / span * classes), classes - 1)
            for band in range(bands):
                both = share[row, one, band] + share[row, two, band]
                rows[k, step, band] += 2.0 * both / (weight * count)


def find_blurred(
    share: FloatArray, here: Hits, there: Hits, scale: float, per_bin: float, bins: int
) -> FloatArray:
    """Return what patches make of one scattering, (batches, bins, bands).

    Rows are as those of `rooms.rays.exchange.Exchange.between`: each batch meets all
    of the other place. `share` has shape (patches, bands), and `scale` is the energy
    of a ray if those of one batch were all.
    """
    batches = len(here.ways)
    rows = np.zeros((2, batches, bins, share.shape[1]))
    sides = [
        (*hits.first, hits.length[:, : hits.mirrored].ravel()) for hits in (here, there)
    ]
    _blur(*sides[0], *sides[1], here.mirrored, share, per_bin, rows)
    return (rows[0] + rows[1]) * (scale * scale / batches)


@njit(cache=True, nogil=True)
def _blur(
    order,
    patch,
    length,
    other_order,
    other_patch,
    other_length,
    each,
    share,
    per_bin,
    rows,
):
    _, batches, bins, bands = rows.shape
    one, other = np.zeros((batches + 1, bins)), np.zeros((batches + 1, bins))
    met = np.zeros((2, batches, bins))
    i = j = 0
    while i < len(order) and j < len(other_order):
        p, q = patch[order[i]], other_patch[other_order[j]]
        if p < q:
            i += 1
            continue
        if q < p:
            j += 1
            continue
        i, low, high = _counted(order, patch, length, i, p, each, per_bin, one)
        j, start, end = _counted(
            other_order, other_patch, other_length, j, p, each, per_bin, other
        )
        # counts are whole numbers: their sums are exact in any order
        for t in range(low, high):
            for u in range(start, min(end, bins - t)):
                for k in range(batches):
                    met[0, k, t + u] += one[k, t] * other[batches, u]
                    met[1, k, t + u] += one[batches, t] * other[k, u]
        for t in range(low + start, min(high + end, bins)):
            for k in range(batches):
                for side in range(2):
                    for band in range(bands):
                        rows[side, k, t, band] += share[p, band] * met[side, k, t]
                    met[side, k, t] = 0.0
        one[:, low:high] = 0.0
        other[:, start:end] = 0.0


@njit(cache=True, nogil=True)
def _counted(order, patch, length, i, wanted, each, per_bin, counts):
    """Count the hits of a patch per time step; return the next hit and the range."""
    bins, last = counts.shape[1], counts.shape[0] - 1
    low, high = bins, 0
    while i < len(order) and patch[order[i]] == wanted:
        t = int(length[order[i]] * per_bin)
        if t < bins:
            counts[order[i] // each, t] += 1.0
            counts[last, t] += 1.0
            low, high = min(low, t), max(high, t + 1)
        i += 1
    return i, min(low, high), high
