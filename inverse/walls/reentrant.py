"""Look for walls that stand between poses: those of rooms that are no boxes.

A box's own early arrivals are blanked; what is left is summed along planes that
cut through the box. A row says something of a plane only where its reflection
would lie inside the box and where no direct sound is known to cross the plane
nearby: an opening reflects nothing.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inverse.paths.oriented_box import OrientedBox
from inverse.walls.box import ALONG_STEP_M
from inverse.walls.scan import (
    REACH_M,
    SHIFTS_S,
    SURE_Z,
    FoundPlane,
    ScanSignals,
    judge_planes,
)
from rir.arrays import BoolArray, FloatArray

__all__ = ["PlaneEvidence", "blanked", "find_outer", "find_reentrant"]

BLANK_S = (3.2e-4, 3.2e-4, 1.9e-4)
"""Blanked to each side of arrivals of order 0, 1 and 2: a period of 3.5 kHz; less for
echoes of two walls, which are many and would take too much with them."""
FINE_STEP_M, FINE_STEPS = 0.005, 6  # 3 cm to both sides, where poses off smear a wall
MARGIN_M = 0.3  # planes so near the outermost places are the outer walls' own
LIKELY_POOLED, MOST_LIKELY = 3.0, 10  # worth a closer look, which costs; few are walls
APART_M = 0.12  # two planes of one direction that are nearer are one wall
OPENING_M = 0.25  # a direct sound that crosses so near shows an opening (0055)
FRONT_M = 0.05  # an end nearer to a plane may stand on either side of it
SPEAKING, LEAST_GROUPS = 0.6, 2  # part of the emitters, and how many (0055)
SURE_POOLED, OUTER_POOLED = 8.0, 6.0
"""Pooled scores of a wall that few emitters light (0055) and of an outer wall, which
more rows can tell."""
GROUP_ROWS = 3  # rows of an emitter that a score takes


@dataclass(frozen=True, eq=False)
class PlaneEvidence:
    """Hold what rows say of planes."""

    signals: ScanSignals
    """Rows with what a box explains blanked."""
    box: OrientedBox
    """The outer walls."""
    seen: BoolArray
    """Rows whose direct sound surely arrived. Shape (rows,)."""

    def hits(self, plane: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Return reflection points, path lengths, and which rows can tell."""
        one, other = self.signals.emitters, self.signals.listeners
        a, b = one @ plane[:3] - plane[3], other @ plane[:3] - plane[3]
        usable = (a > FRONT_M) & (b > FRONT_M)
        total = np.where(usable, a + b, 1.0)
        foot = one - a[:, None] * plane[:3]
        far = other - b[:, None] * plane[:3]
        points = foot + (a / total)[:, None] * (far - foot)
        length = np.sqrt(((one - other) ** 2).sum(axis=1) + 4 * np.maximum(a * b, 0))
        inner = self.box.inside(points)
        held = (inner > self.box.low - 0.02) & (inner < self.box.high + 0.02)
        return points, length, usable & held.all(axis=1)

    def crossings(self, plane: FloatArray) -> FloatArray:
        """Return where direct sounds cross a plane, shape (K, 3)."""
        one = self.signals.emitters[self.seen]
        other = self.signals.listeners[self.seen]
        a, b = one @ plane[:3] - plane[3], other @ plane[:3] - plane[3]
        through = (a * b < 0) & (np.minimum(abs(a), abs(b)) > FRONT_M)
        share = a[through] / (a[through] - b[through])
        return one[through] + share[:, None] * (other[through] - one[through])

    def values(
        self, rows: NDArray[np.int64], length: FloatArray, shifts_m: FloatArray
    ) -> FloatArray:
        """Return rows read at lengths and around them, shape (rows, shifts)."""
        signal = self.signals.signals
        at = (length[:, None] + shifts_m) * self.signals.samples_a_metre
        at = np.clip(at, 0, signal.shape[1] - 2)
        low = at.astype(np.int64)
        part = at - low
        return (1 - part) * signal[rows[:, None], low] + part * signal[
            rows[:, None], low + 1
        ]

    def judged(
        self, plane: FloatArray, opening: FloatArray, least: int = LEAST_GROUPS
    ) -> FoundPlane | None:
        """Judge a plane by the rows that can tell; None if too few groups can."""
        points, length, usable = self.hits(plane)
        if len(opening) and usable.any():
            gap = points[usable, None] - opening
            usable[usable] = (gap**2).sum(axis=2).min(axis=1) > OPENING_M**2
        rows = np.flatnonzero(usable)
        shifts = np.append(0.0, SHIFTS_S)
        values = self.values(rows, length[rows], shifts * 343.0)
        return _found(plane, values, self.signals.groups[rows], least)


def _found(
    plane: FloatArray, values: FloatArray, groups: NDArray[np.int64], least: int
) -> FoundPlane | None:
    z, levels = [], []
    for group in np.unique(groups):
        mine = values[groups == group]
        if len(mine) < GROUP_ROWS:
            continue
        total = mine.sum(axis=0)
        spread = max(float(total[1:].std()), 1e-12)
        z.append((total[0] - total[1:].mean()) / spread)
        levels.append(mine[:, 0].mean())
    if len(z) < least:
        return None
    scores = np.array(z)
    return FoundPlane(
        plane[:3].copy(),
        float(plane[3]),
        float(np.median(scores)),
        float(np.mean(levels)),
        float(np.mean(scores > 3)),
        float(scores.sum() / np.sqrt(len(scores))),
        int(np.sum(scores > 3)),
        float(scores.max()),
    )


def blanked(signals: ScanSignals, box: OrientedBox) -> ScanSignals:
    """Return signals without what the box's images of order 0 to 2 bring."""
    out = signals.signals.copy()
    scale = signals.samples_a_metre
    size = box.high - box.low
    first = box.inside(signals.emitters) - box.low
    second = box.inside(signals.listeners) - box.low
    rows = np.arange(len(out))[:, None]
    for order, index, parity in _low_images():
        gap = second - (1 - 2 * parity) * first - 2 * index * size
        center = np.linalg.norm(gap, axis=1) * scale
        half = int(np.ceil(BLANK_S[order] * 343.0 * scale))
        columns = np.rint(center).astype(np.int64)[:, None]
        columns = columns + np.arange(-half, half + 1)
        held = (columns >= 0) & (columns < out.shape[1])
        out[np.broadcast_to(rows, columns.shape)[held], columns[held]] = 0.0
    return replace(signals, signals=out)


def _low_images() -> list[tuple[int, NDArray[np.int64], NDArray[np.int64]]]:
    from itertools import product

    found = []
    for index in product((-1, 0, 1), repeat=3):
        for parity in product((0, 1), repeat=3):
            m, q = np.array(index), np.array(parity)
            order = int((np.abs(m - q) + np.abs(m)).sum())
            if order < len(BLANK_S):
                found.append((order, m, q))
    return found


def find_reentrant(evidence: PlaneEvidence, normals: FloatArray) -> list[FoundPlane]:
    """Return the planes within the box that several emitters speak for.

    Parameters
    ----------
    evidence : PlaneEvidence
        What the rows say.
    normals : ndarray, shape (N, 3)
        Directions walls may face, into the air.
    """
    found: list[FoundPlane] = []
    for normal in normals:
        kept: list[FoundPlane] = []
        for plane in _likely(evidence, normal):
            better = _sharpened(evidence, plane)
            if better is not None and _sure(better):
                kept.append(better)
        for plane in sorted(kept, key=lambda one: -one.pooled):
            if all(
                plane.normal @ other.normal < 0.99
                or abs(plane.offset - other.offset) > APART_M
                for other in found
            ):
                found.append(plane)
    return found


def find_outer(signals: ScanSignals, box: OrientedBox) -> OrientedBox:
    """Return the box with every wall that several emitters do not speak for redone.

    Such a wall is looked for again with all rows, and is unheard where none is
    sure: an echo of several walls that few rows share must not become one.
    """
    unseen = np.zeros(len(signals.signals), dtype=bool)
    evidence = PlaneEvidence(signals, box.without_walls(), unseen)
    ends = np.concatenate([signals.emitters, signals.listeners])
    nothing = np.empty((0, 3))
    for wall, plane in enumerate(box.planes):
        found = evidence.judged(plane, nothing) if box.found[wall] else None
        if not _outer(found):
            first = float((ends @ plane[:3]).min()) - 0.02
            tried = [
                evidence.judged(np.append(plane[:3], first - step), nothing)
                for step in np.arange(0, REACH_M, ALONG_STEP_M)
            ]
            judged = [one for one in tried if one is not None]
            found = max(judged, key=lambda one: one.pooled, default=None)
        if found is not None and _outer(found):
            box = box.with_wall(wall, found.offset, found.pooled)
        else:
            box = box.with_wall(wall, None, 0.0)
    return box


def _outer(plane: FoundPlane | None) -> bool:
    return (
        plane is not None
        and plane.pooled > OUTER_POOLED
        and plane.speaking >= LEAST_GROUPS
    )


def _sure(plane: FoundPlane) -> bool:
    # a wall round a corner is lit by some of the emitters only
    most = plane.z > SURE_Z and plane.support >= SPEAKING
    return most or (plane.pooled > SURE_POOLED and plane.speaking >= LEAST_GROUPS)


def _likely(evidence: PlaneEvidence, normal: FloatArray) -> list[FloatArray]:
    """Return planes along a normal worth a closer look."""
    signals = evidence.signals
    heights = np.concatenate([signals.emitters, signals.listeners]) @ normal
    offsets = np.arange(
        heights.min() + MARGIN_M, heights.max() - MARGIN_M, ALONG_STEP_M
    )
    if len(offsets) == 0:
        return []
    planes = np.column_stack([np.tile(normal, (len(offsets), 1)), offsets])
    pooled = np.full(len(offsets), -np.inf)
    for plane in judge_planes(signals, planes):
        pooled[int(np.argmin(np.abs(offsets - plane.offset)))] = plane.pooled
    likely: list[FloatArray] = []
    for k in np.argsort(-pooled).tolist():
        if pooled[k] < LIKELY_POOLED or len(likely) == MOST_LIKELY:
            break
        if all(abs(planes[k, 3] - one[3]) > APART_M / 2 for one in likely):
            likely.append(planes[k])
    return likely


def _sharpened(evidence: PlaneEvidence, plane: FloatArray) -> FoundPlane | None:
    """Judge planes close by, openings left out, and return the best."""
    opening = evidence.crossings(plane)
    best: FoundPlane | None = None
    for step in range(-FINE_STEPS, FINE_STEPS + 1):
        tried = plane.copy()
        tried[3] += step * FINE_STEP_M
        found = evidence.judged(tried, opening)
        if found is not None and (best is None or found.pooled > best.pooled):
            best = found
    return best
