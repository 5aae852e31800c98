"""Put a room of flat faces together from its planes and from who sees whom."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inverse.paths.oriented_box import OrientedBox
from inverse.paths.polyhedron import Polyhedron
from inverse.paths.shoebox import FittedRoom
from inverse.rows.direct import DirectSound
from inverse.rows.fitset import FitSet
from inverse.rows.regions import direct_levels, sight_bits
from inverse.walls.box import walled
from inverse.walls.cells import Cell, cut_cells, enclosed, label_cells, shape_of
from inverse.walls.reentrant import (
    FRONT_M,
    PlaneEvidence,
    blanked,
    find_outer,
    find_reentrant,
)
from inverse.walls.scan import BANDS_HZ, FoundPlane, ScanSignals, scan_signals
from inverse.walls.single_emitter_walls import find_single_emitter_walls, nearer_walls
from rir.arrays import BoolArray, FloatArray

__all__ = ["Clues", "Outline", "find_clues", "find_outline", "other_outlines"]

MOST_ROWS = 600  # walls that few rows see need many; time grows with them
SPACE_M = 30.0  # round all places: cells at its bounds lie outside any room
RAY_STEP_M, LEAST_RAYS = 0.1, 3  # one ray may be a direct sound that was taken for seen
FACE_ROWS = 3  # rows that a mean level of a face takes
WALL_SHARE = 0.6
"""A face is a wall where its mean level is that share of its plane's."""


@dataclass(frozen=True, eq=False)
class Outline:
    """Hold the outline of a room: its shape and the inner walls it is made of."""

    shape: Polyhedron | None
    """Walls between the air and the rest; None where those found inside the outer box
    bound no air."""
    found: list[FoundPlane]
    """Walls within the outer box."""
    closed: bool
    """Whether the walls enclose the air."""


@dataclass(frozen=True, eq=False)
class Clues:
    """Hold what rows say of the walls of a room that may be no box.

    Parameters
    ----------
    plain, evidence : PlaneEvidence
        Rows as they are, and without what the outer box explains.
    found : list of FoundPlane
        Walls within the outer box that several emitters speak for.
    """

    plain: PlaneEvidence
    evidence: PlaneEvidence
    found: list[FoundPlane]

    @property
    def box(self) -> OrientedBox:
        """Outer walls that several emitters speak for."""
        return self.evidence.box

    @property
    def normals(self) -> FloatArray:
        """Directions walls may face, shape (6, 3)."""
        return np.concatenate([self.box.axes, -self.box.axes])


def find_clues(rows: FitSet, direct: DirectSound, fitted: FittedRoom) -> Clues:
    """Look for walls inside a fitted box.

    Parameters
    ----------
    rows, direct
        Measured rows, and their direct sounds.
    fitted : FittedRoom
        The outer walls, fitted as if the room were a box.
    """
    rows = rows.spread(MOST_ROWS)
    both = scan_signals(rows, direct, BANDS_HZ[1:])
    signals = both[-1]
    # walls that few rows see need all of them
    box = find_outer(signals, walled([both[0], *both], fitted.room.box.axes))
    seen = _seen(rows, fitted)
    evidence = PlaneEvidence(blanked(signals, box), box, seen)
    normals = np.concatenate([box.axes, -box.axes])
    found = find_reentrant(evidence, normals)
    return Clues(PlaneEvidence(signals, box, seen), evidence, found)


def find_outline(clues: Clues) -> Outline | None:
    """Return the room of all sure walls; None where none stands between poses."""
    return _outlined(clues, clues.box, clues.found) if clues.found else None


def other_outlines(clues: Clues) -> Iterator[Outline]:
    """Yield closed rooms with a wall more that one emitter speaks for."""
    near = nearer_walls(clues.plain, clues.box)
    lone = find_single_emitter_walls(clues.evidence, clues.normals, clues.found)
    boxes = [clues.box] if _same(near, clues.box) else [near, clues.box]
    sets = [[*clues.found, one] for one in lone]
    if len(boxes) > 1:
        sets.append(clues.found)
    for box in boxes:
        for planes in sets:
            outline = _outlined(clues, box, planes)
            if outline.closed and outline.shape and _uses(outline.shape, planes[-1:]):
                yield outline


def _same(one: OrientedBox, other: OrientedBox) -> bool:
    return np.array_equal(one.low, other.low) and np.array_equal(one.high, other.high)


def _outlined(clues: Clues, box: OrientedBox, found: list[FoundPlane]) -> Outline:
    signals, evidence = clues.plain.signals, replace(clues.evidence, box=box)
    planes, inner = _planes(box, found)
    ends = np.concatenate([signals.emitters, signals.listeners])
    low, high = ends.min(axis=0) - SPACE_M, ends.max(axis=0) + SPACE_M
    cells = cut_cells(planes, low, high)
    air = _carved(cells, planes, evidence, ends)
    support = _supports(cells, planes, inner, signals, evidence)
    inside = label_cells(cells, air, support)
    shape = shape_of(cells, inside, planes)
    if shape is None or not _uses(shape, found):
        return Outline(None, found, False)
    return Outline(shape, found, bool(shape.mesh.watertight))


def _seen(rows: FitSet, fitted: FittedRoom) -> BoolArray:
    """Tell for each row whether its direct sound surely arrived."""
    timing = rows.distances, rows.sample_rate, fitted.speed_of_sound
    free = fitted.room.with_order(0, 0)
    alone = free.render(rows.emitters, rows.listeners, rows.n_samples)
    bits = sight_bits(rows.responses, *timing, direct_levels(alone, *timing))
    return bits == 1


def _planes(box: OrientedBox, found: list[FoundPlane]) -> tuple[FloatArray, BoolArray]:
    """Return all planes, shape (P, 4), and which of them lie inside the box."""
    outer = box.planes[box.found]
    inner = np.array([plane.row for plane in found]).reshape(-1, 4)
    return np.concatenate([outer, inner]), np.arange(len(outer) + len(inner)) >= len(
        outer
    )


def _carved(
    cells: list[Cell], planes: FloatArray, evidence: PlaneEvidence, ends: FloatArray
) -> BoolArray:
    """Tell which cells hold air: those with poses or crossed by direct sounds."""
    air = np.zeros(len(cells), dtype=bool)
    clear = np.abs(ends @ planes[:, :3].T - planes[:, 3]).min(axis=1) > FRONT_M
    held = enclosed(cells, planes, ends[clear])
    air[held[held >= 0]] = True
    one = evidence.signals.emitters[evidence.seen]
    other = evidence.signals.listeners[evidence.seen]
    rays = np.zeros(len(cells))
    for start, end in zip(one, other, strict=True):
        steps = max(int(np.linalg.norm(end - start) / RAY_STEP_M), 2)
        share = (np.arange(steps) + 0.5) / steps
        met = enclosed(cells, planes, start + share[:, None] * (end - start))
        number, count = np.unique(met[met >= 0], return_counts=True)
        rays[number[count >= 2]] += 1
    return air | (rays >= LEAST_RAYS)


def _supports(
    cells: list[Cell],
    planes: FloatArray,
    inner: BoolArray,
    signals: ScanSignals,
    evidence: PlaneEvidence,
) -> FloatArray:
    """Return how much of a wall was heard on the faces of cells, (cells, P)."""
    support = np.zeros((len(cells), len(planes)))
    plain = PlaneEvidence(signals, evidence.box, evidence.seen)
    for number, plane in enumerate(planes):
        mine = evidence if inner[number] else plain
        points, length, usable = mine.hits(plane)
        rows = np.flatnonzero(usable)
        levels = mine.values(rows, length[rows], np.zeros(1))[:, 0]
        others = np.arange(len(planes)) != number
        sides = np.where(points[rows] @ planes[:, :3].T > planes[:, 3], 1, -1)
        faces = _face_levels(sides[:, others], levels)
        most = max((level for level, _ in faces.values()), default=0.0)
        for k, cell in enumerate(cells):
            key = tuple(np.array(cell.sides)[others].tolist())
            if number in cell.faces and key in faces:
                support[k, number] = faces[key][0] / (WALL_SHARE * max(most, 1e-12))
    return np.clip(support, 0, 1)


def _face_levels(
    sides: NDArray[np.int64], levels: FloatArray
) -> dict[tuple[int, ...], tuple[float, int]]:
    """Return mean level and number of rows by face."""
    if len(sides) == 0:
        return {}
    keys, number = np.unique(sides, axis=0, return_inverse=True)
    number = number.reshape(-1)
    counts = np.bincount(number)
    means = np.bincount(number, levels) / counts
    return {
        tuple(key.tolist()): (float(mean), int(count))
        for key, mean, count in zip(keys, means, counts, strict=True)
        if count >= FACE_ROWS
    }


def _uses(shape: Polyhedron, found: list[FoundPlane]) -> bool:
    """Tell whether a plane found inside the box bounds the room."""
    return any(
        np.abs(shape.planes - plane.row).max(axis=1).min() < 1e-9 for plane in found
    )
