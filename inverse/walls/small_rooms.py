"""Scan small rooms as if they were larger: cars, booths, bathrooms.

Bands, steps and windows of the scan suit rooms of some metres. In a smaller one first
reflections fall into one another at those bands. Places times k, heard at a k-th of
the sample rate, are the same responses of a room k times as large.
"""

from dataclasses import dataclass, replace

import numpy as np

from inverse.paths.oriented_box import FAR_M, OrientedBox
from inverse.rows.direct import DirectSound, read_direct
from inverse.rows.fitset import FitSet
from inverse.walls.box import assemble_boxes
from inverse.walls.scan import FoundPlane, ScanSignals, scan_planes, scan_signals
from rir import Poses

__all__ = ["RoomScan", "magnification", "scan_room"]

SMALL_M, ORDINARY_M = 4.5, 6.0
"""Diagonal of all places: below the first, a room is scanned as if of the second."""
MOST = 3.0  # the bands of the scan rise as much; loudspeakers beam above 10 kHz
LEAST_RATE_HZ = 4000.0  # of stretched rows: the scan's second band lies below half
SAME_S = 1e-3  # a latency that reads otherwise is of another pulse


@dataclass(frozen=True, eq=False)
class RoomScan:
    """Hold what a scan found."""

    direct: DirectSound
    """The direct sounds, with a pulse no longer than the room allows."""
    signals: list[ScanSignals]
    """The rows in bands, at the room's own size."""
    planes: list[FoundPlane]
    """Planes all places stand in front of."""
    boxes: list[OrientedBox]
    """Boxes they may belong to."""


def scan_room(rows: FitSet, direct: DirectSound, count: int) -> RoomScan:
    """Look for planes and boxes in at most `count` rows."""
    few, times = rows.spread(count), magnification(rows)
    signals = scan_signals(few, direct)
    larger = magnified(rows, times)
    found = read_direct(larger) if times > 1 else direct
    if abs(found.latency_s / times - direct.latency_s) > SAME_S:
        times, found, larger = 1.0, direct, rows
    near = signals if times == 1 else scan_signals(larger.spread(count), found)
    planes = scan_planes(near)
    boxes = assemble_boxes(near, planes)
    return RoomScan(
        replace(found, latency_s=found.latency_s / times),
        signals,
        [replace(plane, offset=plane.offset / times) for plane in planes],
        [_shrunk(box, times) for box in boxes],
    )


def magnification(rows: FitSet) -> float:
    """Return how many times as large a room is scanned; 1 for ordinary ones."""
    ends = np.concatenate([rows.emitters.positions, rows.listeners.positions])
    across = float(np.linalg.norm(np.ptp(ends, axis=0)))
    if across > SMALL_M:
        return 1.0
    most = min(MOST, rows.sample_rate / LEAST_RATE_HZ)
    return float(np.clip(ORDINARY_M / max(across, 1e-9), 1.0, max(most, 1.0)))


def magnified(rows: FitSet, times: float) -> FitSet:
    """Return the same responses of a room so many times as large."""
    ends = [
        Poses(times * one.positions, one.orientations)
        for one in (rows.emitters, rows.listeners)
    ]
    rate = rows.sample_rate / times
    return replace(rows, emitters=ends[0], listeners=ends[1], sample_rate=rate)


def _shrunk(box: OrientedBox, times: float) -> OrientedBox:
    found = box.found
    low, high = box.low / times, box.high / times
    return replace(
        box,
        origin=box.origin / times,
        low=np.where(found[0::2], low, -FAR_M),
        high=np.where(found[1::2], high, FAR_M),
    )
