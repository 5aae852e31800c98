"""The walls of several rooms, each found by its own pairs, in one common frame."""

from dataclasses import replace

import numpy as np

from inverse.paths.oriented_box import FAR_M, OrientedBox
from inverse.rows.direct import DirectSound
from inverse.rows.fitset import FitSet
from inverse.walls.box import SAME_WALL_DEG, SAME_WALL_M, assemble_boxes, walled
from inverse.walls.scan import ScanSignals, judge_planes, scan_planes, scan_signals
from rir.arrays import FloatArray

__all__ = ["find_boxes"]

SCAN_ROWS = 120  # more rows sharpen a scan little and cost it in proportion
LEAST_ROWS = 12  # pairs within one room; fewer find no six walls
MOST_Z = 12.0  # a score beyond is no surer: loud walls must not outvote faint ones
OWN_FRAME = 0.8
"""Rooms of one building mostly share a frame; one room alone tells it roughly."""
LEAST_WALLS = 4  # two directions: what remains may be found from the next room
TURNS_DEG = 0.3, 0.1, 0.03  # from the scan's error to 3 mm over 6 m
POOLED, SHARE = 2.0, 0.1
"""Score and part of the loudest level that do for a wall known from the next room."""
BEYOND_M, HELD = 0.05, 0.02
"""A wall that takes a fiftieth of another room's places in, 5 cm deep, stands too far
out; single places may be off or in the door."""
FOUND_Z = 6.0  # a wall below is left out: the rooms' fit would lean on it (0065)


def find_boxes(rooms: list[FitSet], direct: DirectSound) -> list[OrientedBox | None]:
    """Return the box round the pairs of each room; None where too little is heard.

    The clearest room is turned to where its walls are clearest; its attitude is
    tried in all others, and its walls
    where they would go on. A wall that would hold places of another room is unheard.

    Parameters
    ----------
    rooms : list of FitSet
        Pairs whose ends share a room, one set a room.
    direct : DirectSound
        What direct sounds have in common.
    """
    scans = {}
    for k, rows in enumerate(rooms):
        if len(rows) >= LEAST_ROWS:
            scans[k] = _scanned(rows, direct)
    boxes: list[OrientedBox | None] = [None] * len(rooms)
    known: list[OrientedBox] = []
    clear = {k: max(map(_clearness, own), default=0.0) for k, (_, own) in scans.items()}
    for k in sorted(scans, key=lambda k: -clear[k]):
        signals, own = scans[k]
        if known:
            box = _framed(signals, own, known[0])
        elif own:
            box = own[0] if own[0].found.all() else _searched(rooms[k], direct, own)
            box = _turned(signals, box)
        else:
            return boxes
        boxes[k] = box
        known.append(box)
    for k, (signals, _) in scans.items():
        box = boxes[k]
        if box is not None:
            others = [one for one in known if one is not box]
            box = _apart(_going_on(box, signals[-1], others), rooms, k)
            boxes[k] = _sure(box)
    return boxes


def _sure(box: OrientedBox) -> OrientedBox:
    """Return the box without walls that too little speaks for."""
    faint = box.z.reshape(3, 2) < FOUND_Z
    return replace(
        box,
        low=np.where(faint[:, 0], -FAR_M, box.low),
        high=np.where(faint[:, 1], FAR_M, box.high),
        z=np.where(faint, 0.0, box.z.reshape(3, 2)).ravel(),
    )


def _framed(
    signals: list[ScanSignals], own: list[OrientedBox], first: OrientedBox
) -> OrientedBox:
    """Return the box in the frame of another room unless its own is clearer."""
    shared = walled(signals, first.axes)
    best = max(own, key=_clearness, default=shared)
    return best if OWN_FRAME * _clearness(best) > _clearness(shared) else shared


def _turned(signals: list[ScanSignals], box: OrientedBox) -> OrientedBox:
    """Return the box turned by parts of a degree to where its walls are clearest."""
    best = _strength(signals[-1], box)
    for step in np.radians(TURNS_DEG):
        for axis in [0, 1, 2, 0, 1, 2]:
            for sign in (-1, 1):
                while True:
                    turned = box.turned(sign * step * np.eye(3)[axis])
                    tried = walled(signals, turned.axes)
                    now = _strength(signals[-1], tried)
                    if now <= best or not (tried.found | ~box.found).all():
                        break
                    box, best = tried, now
    return box


def _strength(signals: ScanSignals, box: OrientedBox) -> float:
    found = judge_planes(signals, box.planes[box.found])
    return float(sum(plane.strength for plane in found))


def _searched(
    rows: FitSet, direct: DirectSound, boxes: list[OrientedBox]
) -> OrientedBox:
    from inverse.walls.box_search import search_box

    return search_box(rows, direct, boxes).box


def _scanned(
    rows: FitSet, direct: DirectSound
) -> tuple[list[ScanSignals], list[OrientedBox]]:
    signals = scan_signals(rows.spread(SCAN_ROWS), direct)
    boxes = assemble_boxes(signals, scan_planes(signals))
    boxes = [box for box in boxes if box.found.sum() >= LEAST_WALLS]
    return signals, boxes


def _clearness(box: OrientedBox) -> float:
    return float(np.where(box.found, np.minimum(box.z, MOST_Z), 0.0).sum())


def _apart(box: OrientedBox, rooms: list[FitSet], mine: int) -> OrientedBox:
    """Return the box without walls that would hold other rooms' places."""
    low, high, z = box.low.copy(), box.high.copy(), box.z.copy()
    for k, rows in enumerate(rooms):
        if k == mine or len(rows) == 0:
            continue
        ends = np.concatenate([rows.emitters.positions, rows.listeners.positions])
        local = box.inside(ends)
        held = ((local > low + BEYOND_M) & (local < high - BEYOND_M)).all(axis=1)
        if held.mean() < HELD:
            continue
        own = box.inside(
            np.concatenate(
                [rooms[mine].emitters.positions, rooms[mine].listeners.positions]
            )
        )
        # the way on which the two rooms lie apart has the wall between them
        below = own.min(axis=0) - local.max(axis=0)
        above = local.min(axis=0) - own.max(axis=0)
        wall = int(np.argmax(np.concatenate([below, above])))
        if wall < 3:
            low[wall], z[2 * wall] = -FAR_M, 0.0
        else:
            high[wall - 3], z[2 * wall - 5] = FAR_M, 0.0
    return replace(box, low=low, high=high, z=z)


def _going_on(
    box: OrientedBox, signals: ScanSignals, known: list[OrientedBox]
) -> OrientedBox:
    """Return the box with walls of other rooms in place of farther ones."""
    ends = np.concatenate([signals.emitters, signals.listeners])
    low, high, z = box.low.copy(), box.high.copy(), box.z.copy()
    judged = judge_planes(signals, box.planes[box.found])
    loud = max((plane.strength for plane in judged), default=0.0)
    for other in known:
        for plane in other.planes[other.found]:
            wall = _aligned(box, plane)
            if wall is None or (ends @ plane[:3] - plane[3]).min() < 0:
                continue
            axis, upper = divmod(wall, 2)
            now = box.planes[wall]
            middle = float(box.axes[axis] @ box.origin)
            center = ends.mean(axis=0)
            foot = center - (center @ plane[:3] - plane[3]) * plane[:3]
            offset = float(foot @ now[:3])
            if offset - now[3] < SAME_WALL_M:
                continue
            found = judge_planes(signals, np.append(now[:3], offset)[None])
            if not found or found[0].pooled < POOLED:
                continue
            if found[0].strength < SHARE * loud:
                continue
            # two rooms speak for it
            z[wall] = max(found[0].pooled, FOUND_Z)
            if upper:
                high[axis] = -offset - middle
            else:
                low[axis] = offset - middle
    return replace(box, low=low, high=high, z=z)


def _aligned(box: OrientedBox, plane: FloatArray) -> int | None:
    along = box.planes[:, :3] @ plane[:3]
    wall = int(np.argmax(along))
    return wall if along[wall] > np.cos(np.radians(SAME_WALL_DEG)) else None
