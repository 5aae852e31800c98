"""Walls that a single emitter speaks for: never sure, but worth a trial.

An arm of a room may hold one emitter only. Its walls are then heard by that one, and
so are echoes of several walls that pass for others. Such planes are handed over one by
one; the fit of the whole room they make decides.
"""

from dataclasses import replace

import numpy as np

from inverse.paths.oriented_box import OrientedBox
from inverse.walls.reentrant import APART_M, MARGIN_M, SURE_POOLED, PlaneEvidence
from inverse.walls.scan import FoundPlane
from rir.arrays import FloatArray

__all__ = ["find_single_emitter_walls", "nearer_walls"]

STEP_M, FINE_STEP_M, FINE_STEPS = 0.02, 0.005, 4  # each fine step within a coarse one
REACH_M = 6.0  # behind the nearest place: an arm of a room is no larger
MOST, CLOSER = 3, 4  # the room's fit judges each: seconds; sharpening costs less


def find_single_emitter_walls(
    evidence: PlaneEvidence, normals: FloatArray, known: list[FoundPlane]
) -> list[FoundPlane]:
    """Return planes within the box that one emitter speaks for, the clearest first.

    Parameters
    ----------
    evidence : PlaneEvidence
        What the rows say.
    normals : ndarray, shape (N, 3)
        Directions walls may face, into the air.
    known : list of FoundPlane
        Planes that are sure; none along the same normal is returned.
    """
    signals, found = evidence.signals, []
    ends = np.concatenate([signals.emitters, signals.listeners])
    for normal in normals:
        if any(normal @ one.normal > 0.99 for one in known):
            continue
        heights = ends @ normal
        offsets = np.arange(heights.min() + MARGIN_M, heights.max() - MARGIN_M, STEP_M)
        planes = _clearest(evidence, normal, offsets)[:CLOSER]
        found += [_sharpened(evidence, plane.row) for plane in planes]
    loud = [one for one in found if one.loudest > SURE_POOLED and one.strength > 0]
    return sorted(loud, key=lambda one: -one.loudest)[:MOST]


def nearer_walls(evidence: PlaneEvidence, box: OrientedBox) -> OrientedBox:
    """Return the box with walls one emitter hears clearly before those that stand.

    Parameters
    ----------
    evidence : PlaneEvidence
        Rows with nothing blanked.
    box : OrientedBox
        As several emitters speak for it.
    """
    signals = evidence.signals
    evidence = replace(evidence, box=box.without_walls())
    ends = np.concatenate([signals.emitters, signals.listeners])
    for wall, plane in enumerate(box.planes):
        first = float((ends @ plane[:3]).min()) - 0.02
        last = max(plane[3] + APART_M, first - REACH_M)
        planes = _clearest(evidence, plane[:3], np.arange(first, last, -STEP_M))
        if not planes:
            continue
        best = _sharpened(evidence, planes[0].row)
        box = box.with_wall(wall, best.offset, best.pooled)
    return box


def _clearest(
    evidence: PlaneEvidence, normal: FloatArray, offsets: FloatArray
) -> list[FoundPlane]:
    """Return planes along a normal that an emitter speaks for, the clearest first."""
    nothing = np.empty((0, 3))
    tried = [
        evidence.judged(np.append(normal, offset), nothing, 1) for offset in offsets
    ]
    loud = [one for one in tried if one is not None and one.loudest > SURE_POOLED]
    kept: list[FoundPlane] = []
    for one in sorted(loud, key=lambda plane: -plane.loudest):
        if all(abs(one.offset - other.offset) > APART_M for other in kept):
            kept.append(one)
    return kept


def _sharpened(evidence: PlaneEvidence, plane: FloatArray) -> FoundPlane:
    """Return the best plane close by, openings left out."""
    opening = evidence.crossings(plane)
    best = FoundPlane(plane[:3].copy(), float(plane[3]), 0.0, 0.0, 0.0)
    for step in range(-FINE_STEPS, FINE_STEPS + 1):
        moved = np.append(plane[:3], plane[3] + step * FINE_STEP_M)
        found = evidence.judged(moved, opening, 1)
        if found is not None and found.loudest > best.loudest:
            best = found
    return best
