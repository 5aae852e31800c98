"""The walls between rooms, and the rooms and holes put together to one shape."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from inverse.paths.oriented_box import OrientedBox
from inverse.paths.polyhedron import Polyhedron
from inverse.walls.box import SAME_WALL_DEG, SQUARE_DEG
from inverse.walls.cells import cut_cells, shape_of
from inverse.walls.opening import Opening, Slab
from rir.arrays import FloatArray

__all__ = ["find_slab", "half_slab", "joined_shape", "with_face"]

THICKEST_M, THINNEST_M = 1.0, 0.005  # an old house's wall; a board, and errors
SHARED_M = 0.5  # rooms that share less of a wall have no door in it
UPRIGHT = 0.9  # faces leaning by more than 6 degrees are no walls between rooms
SAME_M = 0.03  # two rooms' faces in one plane agree so well before a fit
BEYOND_M = 5.0  # round all rooms: cells at its bounds lie outside
CLEAR_M = 1e-3  # a hole reaches to both faces, rounding allowed for


def find_slab(first: OrientedBox, second: OrientedBox) -> Slab | None:
    """Return the wall whose two faces two rooms have; None where there is none.

    The faces look at one another's backs, no more than a metre apart, and the rooms
    lie before and behind the same part of it.
    """
    found: list[tuple[float, Slab]] = []
    for plane in first.planes[first.found]:
        for back in second.planes[second.found]:
            if plane[:3] @ back[:3] > -np.cos(np.radians(SQUARE_DEG)):
                continue
            if abs(plane[2]) > 1 - UPRIGHT:
                continue
            middle = _corners(second).mean(axis=0)
            # the back face is as far as it is where the second room looks at it
            foot = middle - (middle @ back[:3] - back[3]) * back[:3]
            thick = plane[3] - float(foot @ plane[:3])
            if not -THINNEST_M < thick < THICKEST_M:
                continue
            slab = _slab(plane, max(thick, THINNEST_M), first, second)
            along, up = slab.limits[1] - slab.limits[0], slab.limits[3] - slab.limits[2]
            if along > SHARED_M and up > SHARED_M:
                found.append((-along * up, slab))
    return min(found, key=lambda one: one[0])[1] if found else None


def half_slab(first: OrientedBox, second: OrientedBox, ends: FloatArray) -> Slab | None:
    """Return a wall whose far face is unheard, as thick as it could be.

    Parameters
    ----------
    first, second : OrientedBox
        Rooms before the face that was heard, and behind it; a wall of the second
        that looks this way is unheard.
    ends : ndarray, shape (n, 3)
        Places in the second room.
    """
    made: list[tuple[float, Slab]] = []
    for plane in first.planes[first.found]:
        along = second.planes[:, :3] @ plane[:3]
        wall = int(np.argmin(along))
        facing = along[wall] < -np.cos(np.radians(SQUARE_DEG))
        if not facing or second.found[wall] or abs(plane[2]) > 1 - UPRIGHT:
            continue
        behind = float((plane[3] - ends @ plane[:3]).min())
        if behind > THINNEST_M:
            slab = _slab(plane, min(behind, THICKEST_M), first, second)
            made.append((behind, slab))
    return min(made, key=lambda one: one[0])[1] if made else None


def with_face(box: OrientedBox, slab: Slab) -> OrientedBox:
    """Return the second room of a slab with its wall where the slab ends."""
    normal = -slab.frame[0]
    wall = int(np.argmax(box.planes[:, :3] @ normal))
    axis, upper = divmod(wall, 2)
    middle = _corners(box).clip(-1e3, 1e3).mean(axis=0)
    gap = slab.local(middle[None])[0, 0] + slab.thick
    face = box.inside((middle - gap * slab.frame[0])[None])[0, axis]
    low, high = box.low.copy(), box.high.copy()
    (high if upper else low)[axis] = face
    return replace(box, low=low, high=high)


def _slab(
    plane: FloatArray, thick: float, first: OrientedBox, second: OrientedBox
) -> Slab:
    up = np.array([0.0, 0.0, 1.0])
    up = up - (up @ plane[:3]) * plane[:3]
    up /= np.linalg.norm(up)
    frame = np.array([plane[:3], np.cross(up, plane[:3]), up])
    origin = plane[3] * plane[:3]
    limits = []
    for axis in (1, 2):
        spans = [(_corners(box) - origin) @ frame[axis] for box in (first, second)]
        limits += [
            max(float(span.min()) for span in spans),
            min(float(span.max()) for span in spans),
        ]
    return Slab(origin, frame, thick, np.array(limits))


def _corners(box: OrientedBox) -> FloatArray:
    sides = np.stack(np.meshgrid(*[[0, 1]] * 3, indexing="ij"), -1).reshape(-1, 3)
    local = np.where(sides == 1, box.high, box.low)
    return box.origin + local @ box.axes


def joined_shape(
    boxes: list[OrientedBox], openings: list[Opening]
) -> Polyhedron | None:
    """Return rooms and the holes between them as one shape.

    Walls of two rooms that lie in one plane become one.
    """
    rows: list[FloatArray] = []
    middles = [_corners(box).mean(axis=0) for box in boxes]
    for box, middle in zip(boxes, middles, strict=True):
        for plane in box.planes:
            if not any(_same(plane, other, middle) for other in rows):
                rows.append(plane)
    for opening in openings:
        rows += _edges(opening)
    planes = np.array(rows)
    corners = np.concatenate([_corners(box) for box in boxes])
    low, high = corners.min(axis=0) - BEYOND_M, corners.max(axis=0) + BEYOND_M
    cells = cut_cells(planes, low, high)
    centers = np.array([cell.center for cell in cells])
    inside = np.zeros(len(cells), dtype=bool)
    for box in boxes:
        local = box.inside(centers)
        inside |= ((local > box.low - SAME_M) & (local < box.high + SAME_M)).all(axis=1)
    for opening in openings:
        inside |= _in_hole(opening, centers)
    return shape_of(cells, inside, planes)


def _same(plane: FloatArray, other: FloatArray, middle: FloatArray) -> bool:
    """Tell whether two planes are one, seen from the middle of a room."""
    along = float(plane[:3] @ other[:3])
    if abs(along) < np.cos(np.radians(SAME_WALL_DEG)):
        return False
    foot = middle - (middle @ plane[:3] - plane[3]) * plane[:3]
    return abs(float(foot @ other[:3]) - other[3]) < SAME_M


def _edges(opening: Opening) -> list[FloatArray]:
    """Return the planes of the hole's edges that are known."""
    slab, made = opening.slab, []
    for side in np.flatnonzero(opening.known).tolist():
        normal = slab.frame[1 + side // 2] * (1 if side % 2 == 0 else -1)
        point = slab.origin + opening.hole[side] * slab.frame[1 + side // 2]
        made.append(np.append(normal, normal @ point))
    return made


def _in_hole(opening: Opening, points: FloatArray) -> NDArray[np.bool_]:
    slab, hole = opening.slab, opening.hole
    local = slab.local(points)
    held = (local[:, 0] < CLEAR_M) & (local[:, 0] > -slab.thick - CLEAR_M)
    for axis in (1, 2):
        low, high = hole[2 * axis - 2], hole[2 * axis - 1]
        held &= (local[:, axis] > low) & (local[:, axis] < high)
    return held
