"""How boxes are put together from planes that were found."""

import numpy as np

from inverse.paths.oriented_box import FAR_M, OrientedBox
from inverse.walls.scan import (
    REACH_M,
    SURE_Z,
    FoundPlane,
    ScanSignals,
    judge_planes,
)
from rir.arrays import FloatArray

__all__ = ["assemble_boxes", "walled"]

SQUARE_DEG = 3.0  # found planes are off by as much as the normals of the scan are apart
SQUARE = np.sin(np.radians(SQUARE_DEG))
ALONG_STEP_M = 0.01  # an echo moves by 2 cm, a fifth of a wave of the widest band
FINE_STEP_M, FINE_STEPS = 0.004, 5  # 2 cm to both sides: two steps before
SURE_ALONG = 5.0  # pooled score; more than a plane's: it is the best of 900 offsets
FAINT = 0.35
"""Of the strongest along a normal. Lower, ripple before a wall passes for it; higher,
walls behind a cardioid are missed (decision 0054)."""
UPRIGHT, FRAMES = 2.0, 8
"""Rooms with a level floor are likelier: such a frame counts twice. Each frame costs a
fit; with eight, phantoms of a single emitter leave the true one among them."""
FLAT_M = 0.1  # places of less extent lie in one plane: their walls have mirror twins
SAME_WALL_M = 0.15  # two echoes closer than 0.3 m of path are one wall's
SAME_WALL_DEG = 1.5  # of two rooms; wider, walls that differ become one


def assemble_boxes(
    signals: list[ScanSignals], found: list[FoundPlane]
) -> list[OrientedBox]:
    """Return boxes that found planes may belong to, the likeliest first.

    Images of higher order pass as planes where there is one emitter only, so
    several frames are tried; the fit decides between them.
    """
    sure = [plane for plane in found if plane.z > SURE_Z]
    boxes = []
    for axes in _likely_axes(sure):
        boxes.append(walled(signals, axes))
        if len(boxes) == 1 and boxes[0].found.all() and signals[0].n_groups > 1:
            break
    return boxes


def walled(signals: list[ScanSignals], axes: FloatArray) -> OrientedBox:
    """Return the box whose walls are found along given axes, shape (3, 3)."""
    one = signals[-1]
    ends = np.concatenate([one.emitters, one.listeners])
    origin = ends.mean(axis=0)
    low, high, z = np.full(3, -FAR_M), np.full(3, FAR_M), np.zeros(6)
    for axis in range(3):
        below = _along(signals, axes[axis], ends)
        above = _along(signals, -axes[axis], ends)
        flat = float(np.ptp(ends @ axes[axis])) < FLAT_M
        lower, upper = _apart(below, above, axes[axis], origin, flat)
        middle = float(axes[axis] @ origin)
        if lower is not None:
            low[axis], z[2 * axis] = lower.offset - middle, lower.pooled
        if upper is not None:
            high[axis], z[2 * axis + 1] = -upper.offset - middle, upper.pooled
    return OrientedBox(axes, origin, low, high, z)


def _likely_axes(planes: list[FoundPlane]) -> list[FloatArray]:
    """Return right-handed frames that many found planes are square to."""
    scored: list[tuple[float, FloatArray]] = []
    for i, one in enumerate(planes):
        for other in planes[i + 1 :]:
            if abs(one.normal @ other.normal) > SQUARE:
                continue
            third = np.cross(one.normal, other.normal)
            frame = _squared(np.array([one.normal, other.normal, third]))
            upright = float(np.abs(frame[:, 2]).max()) > np.cos(SQUARE)
            score = _fit_of(frame, planes) * (UPRIGHT if upright else 1.0)
            scored.append((score, frame))
    for one in planes:
        frame = _squared(_upright(one.normal))
        upright = float(np.abs(frame[:, 2]).max()) > np.cos(SQUARE)
        scored.append((_fit_of(frame, planes) * (UPRIGHT if upright else 0.5), frame))
    kept: list[FloatArray] = []
    for _, frame in sorted(scored, key=lambda one: -one[0]):
        axes = _ordered(_averaged(frame, planes))
        if all(np.abs(np.diag(axes @ other.T) - 1).max() > 2e-3 for other in kept):
            kept.append(axes)
        if len(kept) == FRAMES:
            break
    return kept


def _upright(normal: FloatArray) -> FloatArray:
    up = np.array([0.0, 0.0, 1.0])
    other = up if abs(normal @ up) < 0.9 else np.array([1.0, 0.0, 0.0])
    second = other - (other @ normal) * normal
    second /= np.linalg.norm(second)
    return np.array([normal, second, np.cross(normal, second)])


def _squared(frame: FloatArray) -> FloatArray:
    before, _, after = np.linalg.svd(frame)
    return before @ after


def _shares(frame: FloatArray, planes: list[FoundPlane]) -> FloatArray:
    weight = np.array([min(plane.z, 12.0) * plane.strength for plane in planes])
    along = np.abs(np.array([plane.normal for plane in planes]) @ frame.T)
    return weight[:, None] * (along > np.sqrt(1 - SQUARE**2))


def _fit_of(frame: FloatArray, planes: list[FoundPlane]) -> float:
    # one wall counts once, however many phantoms lie behind it
    shares = _shares(frame, planes)
    normals = np.array([plane.normal for plane in planes])
    total = 0.0
    for axis in range(3):
        for sign in (-1, 1):
            side = (normals @ frame[axis]) * sign > 0
            total += float((shares[:, axis] * side).max(initial=0.0))
    return total


def _averaged(frame: FloatArray, planes: list[FoundPlane]) -> FloatArray:
    """Return the frame averaged over all planes square to it."""
    shares = _shares(frame, planes)
    normals = np.array([plane.normal for plane in planes])
    sums = np.empty((3, 3))
    for axis in range(3):
        sign = np.sign(normals @ frame[axis])
        sums[axis] = (shares[:, axis] * sign) @ normals + 1e-3 * frame[axis]
    return _squared(sums / np.linalg.norm(sums, axis=1, keepdims=True))


def _ordered(frame: FloatArray) -> FloatArray:
    """Return the frame with its axes named after the nearest of x, y and z."""
    from itertools import permutations

    best = max(
        permutations(range(3)),
        key=lambda order: sum(abs(frame[k, i]) for i, k in enumerate(order)),
    )
    named = frame[list(best)]
    return named * np.sign(np.diag(named))[:, None]


def _along(
    signals: list[ScanSignals], normal: FloatArray, ends: FloatArray
) -> list[FoundPlane]:
    """Return walls along one normal, the nearest first."""
    first = float((ends @ normal).min()) + 0.02
    steps = np.arange(round(REACH_M / ALONG_STEP_M), dtype=np.float64)
    offsets = first - ALONG_STEP_M * steps
    planes: FloatArray = np.empty((len(offsets), 4))
    planes[:, :3], planes[:, 3] = normal, offsets
    sums, counts = signals[1].sums(planes, np.zeros(1))
    # a wall between poses has ends behind it; those rows say nothing
    level = sums[..., 0].sum(axis=1) / np.maximum(counts.sum(axis=1), 1.0)
    peaks = np.flatnonzero((level[1:-1] >= level[:-2]) & (level[1:-1] > level[2:]))
    order = peaks[np.argsort(-level[1:-1][peaks])][:12] + 1
    judged = judge_planes(signals[-1], _sharpened(signals[-1], planes[order]))
    sure = [plane for plane in judged if plane.pooled > SURE_ALONG]
    most = max((plane.strength for plane in sure), default=0.0)
    loud = [plane for plane in sure if plane.strength > FAINT * most]
    # images of higher order stand behind the wall, never before it
    kept: list[FoundPlane] = []
    for plane in sorted(loud, key=lambda one: -one.offset):
        if all(abs(plane.offset - other.offset) > SAME_WALL_M for other in kept):
            kept.append(plane)
    return kept


def _sharpened(signals: ScanSignals, planes: FloatArray) -> FloatArray:
    """Move each plane along its normal to the best offset nearby."""
    if len(planes) == 0:
        return planes
    moves = np.arange(-FINE_STEPS, FINE_STEPS + 1) * FINE_STEP_M
    tried = np.repeat(planes, len(moves), axis=0)
    tried[:, 3] += np.tile(moves, len(planes))
    sums, _ = signals.sums(tried, np.zeros(1))
    level = sums[..., 0].sum(axis=1).reshape(len(planes), -1)
    best = planes.copy()
    best[:, 3] += moves[np.argmax(level, axis=1)]
    return best


def _apart(
    below: list[FoundPlane],
    above: list[FoundPlane],
    axis: FloatArray,
    origin: FloatArray,
    flat: bool,
) -> tuple[FoundPlane | None, FoundPlane | None]:
    """Return one wall for each side.

    Where all poses lie in one plane, walls above and below it are mirror twins:
    each is heard on both sides at the same distance. The nearest is then put
    below and the next one above; which is which cannot be heard.
    """
    lower, upper = (below[0] if below else None), (above[0] if above else None)
    if not flat or lower is None or upper is None:
        return lower, upper
    middle = float(axis @ origin)
    down, up = middle - lower.offset, -middle - upper.offset
    if abs(down - up) > SAME_WALL_M:
        return lower, upper
    rest = [wall for wall in above if abs(-middle - wall.offset - down) > SAME_WALL_M]
    return lower, (rest[0] if rest else upper)
