"""Places in a box: what they leave on its walls, and what they exchange."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rir.arrays import FloatArray
from rooms.transport.box import BoxTransport
from rooms.transport.corners import BoxCorner, in_one_corner
from rooms.transport.single import CLASSES, collect_hits, join_hits

__all__ = ["BoxPlace", "find_places", "pair_energy"]


_TOGETHER = 16
"""Places solved in one go, so that the factors of the walls are read once for all."""

_KEPT = 256
"""Places a box remembers: with their columns, some 100 MB in seven octaves."""


@dataclass(frozen=True, eq=False)
class BoxPlace:
    """What a place leaves on the walls.

    Parameters
    ----------
    position, nearest : ndarray, shape (3,)
        Where it is [m], and which walls are the nearer ones.
    column : ndarray, shape (freq * lanes, 2, functions)
        All of it, solved for all that follows.
    close : ndarray, shape (freq * lanes, 2, functions)
        What arrives straight or mirrored close by.
    hits : tuple of ndarray
        The same, ray by ray: see `rooms.transport.single.collect_hits`.
    kept : ndarray, shape (6, classes, lanes)
        What close mirrors leave of each class of hits.
    corner : BoxCorner
        What keeps close to it.
    """

    position: FloatArray
    nearest: Any
    column: Any
    close: Any
    hits: tuple[Any, ...]
    kept: FloatArray
    corner: BoxCorner


def find_places(box: BoxTransport, positions: FloatArray) -> list[BoxPlace]:
    """Return places at positions, shape (places, 3); known ones are not redone."""
    positions = np.ascontiguousarray(positions, dtype=float)
    keys = [position.tobytes() for position in positions]
    new = list(dict.fromkeys(key for key in keys if key not in box.known))
    found = {key: box.known[key] for key in keys if key in box.known}
    for some in range(0, len(new), _TOGETHER):
        part = new[some : some + _TOGETHER]
        found.update(zip(part, _make_places(box, part), strict=True))
    for key in new[:_KEPT]:
        box.known[key] = found[key]
    while len(box.known) > _KEPT:
        box.known.pop(next(iter(box.known)))
    return [found[key] for key in keys]


def _make_places(box: BoxTransport, keys: list[bytes]) -> list[BoxPlace]:
    positions = np.stack([np.frombuffer(key) for key in keys])
    parts = [_close(box, position) for position in positions]
    columns = box.columns(box.place_moments(positions))
    return [
        BoxPlace(
            position,
            nearest,
            column,
            close,
            hits,
            kept,
            BoxCorner(box, position, nearest, hits, kept, close),
        )
        for (position, nearest, close, hits, kept), column in zip(
            parts, columns, strict=True
        )
    ]


def _close(box: BoxTransport, position: FloatArray) -> Any:
    nearest = (position > box.size / 2).astype(np.int64)
    rays = box.place_rays
    count = 3 * len(rays[0])
    whole = np.empty((count, 2), dtype=np.int64)
    points, values = np.empty((count, 3)), np.empty((count, 3))
    used = collect_hits(
        box.size, position, nearest, box.mirrors, rays, whole, points, values
    )
    hits = whole[:used], points[:used], values[:used]
    kept = _kept(box, nearest)
    close = box.moments_of(hits, kept * box.gate[:, None])
    return position, nearest, close, hits, kept


def _kept(box: BoxTransport, nearest: Any) -> FloatArray:
    """Return what close mirrors leave of each class, shape (6, classes, lanes)."""
    kept = np.ones((6, CLASSES, box.lanes))
    for wall in range(6):
        for bit in range(2):
            axis = (wall // 2 + 1 + bit) % 3
            some = [k for k in range(CLASSES) if k >> bit & 1]
            kept[wall, some] *= box.mirrored[2 * axis + nearest[axis]]
    return kept


def pair_energy(
    box: BoxTransport, one: BoxPlace, other: BoxPlace, step: float, steps: int
) -> FloatArray:
    """Return scattered energy per second in steps of time, shape (steps, bands).

    The same to the last bit if the places are exchanged.
    """
    products = [(one.column, other.column, 1.0), (one.close, other.close, -1.0)]
    chains = np.zeros((steps, box.lanes))
    if in_one_corner(box, one.position, other.position):
        ends = (place.corner for place in (one, other))
        # in one order, whichever end is which
        first, second = sorted(ends, key=lambda end: tuple(end.position.tolist()))
        products.append((first.close, second.smooth, -1.0))
        chains = first.heard(second, step, steps) + second.heard(first, step, steps)
    spectrum = box.meet(*products)
    first = float(np.linalg.norm(one.position - other.position)) / box.speed
    smooth = box.resampled(spectrum, step, steps, first)
    single = _single(box, one, other, step, steps)
    single += _single(box, other, one, step, steps)
    energy = smooth + (single + chains)
    k = int(first / step)
    if k + 1 < steps:
        # what arrives in the rest of a step that the direct sound has begun already
        energy[k + 1] += energy[k]
        energy[k] = 0.0
    return energy[:, box.lane_of]


def _single(
    box: BoxTransport, one: BoxPlace, other: BoxPlace, step: float, steps: int
) -> FloatArray:
    out = np.zeros((steps, box.lanes))
    factor = box.scattered * (16 * np.pi / step)
    there = other.position, other.nearest, other.kept, box.mirrors
    per_bin = 1.0 / (box.speed * step)
    join_hits(box.size, one.hits, one.kept, there, factor, per_bin, out)
    return out
