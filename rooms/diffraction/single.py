"""Ways around one edge, also mirrored once before or after it."""

from collections.abc import Iterator

import numpy as np

from rir.arrays import FloatArray, IntArray
from rooms.diffraction.bender import Bender
from rooms.diffraction.ends import Ends, Legs, are_mirrored, mirrored_ends

__all__ = ["bent_once"]

_BLOCK = 200_000
"""Pairs times edges looked at in one go."""


def bent_once(
    bender: Bender, emitter: FloatArray, listeners: FloatArray, mirrors: int
) -> list[tuple]:
    """Return rows of all ways around one edge; see `DiffractedPaths`.

    A mirrored way is one from or to an image in a panel, bent like any other: the
    edge sees the image. A panel that holds the edge is left out, since what its
    faces mirror is part of the diffraction itself.
    """
    geometry = bender.geometry
    starts = mirrored_ends(geometry, emitter[None], mirrors > 0)
    ends = mirrored_ends(geometry, listeners, mirrors > 0)
    # at most one mirror on a way
    count, plain, images = len(ends), len(listeners), len(starts) - 1
    first = np.concatenate(
        [np.zeros(count, int), np.repeat(np.arange(images) + 1, plain)]
    )
    last = np.concatenate([np.arange(count), np.tile(np.arange(plain), images)])
    step = max(1, _BLOCK // max(1, len(bender.edges)))
    rows: list[tuple] = []
    for begin in range(0, len(first), step):
        some = slice(begin, begin + step)
        rows += _ways(bender, (starts, first[some]), (ends, last[some]))
    return rows


def _ways(
    bender: Bender, one: tuple[Ends, IntArray], other: tuple[Ends, IntArray]
) -> Iterator[tuple]:
    """Yield rows of ways between pairs: ends, and which of them each pair has."""
    geometry, edges = bender.geometry, bender.edges
    near, far = (_around(bender, *side) for side in (one, other))
    starts, ends = (side[which] for side, which in (one, other))
    total = near[0] + far[0]
    with np.errstate(invalid="ignore", divide="ignore"):
        place = (near[1] * far[0] + far[1] * near[0]) / total
    usable = (place >= 0) & (place < edges.length)
    usable &= (near[0] > 0) & (far[0] > 0)
    usable &= (near[2] < edges.opening) & (far[2] < edges.opening)
    for side in (starts, ends):
        usable &= ~(bender.holds[side.panel] & side.mirrored[:, None])
    pair, edge = np.nonzero(usable)
    if bender.fading:
        for panel in edges.panels[edge].T:
            shown = are_mirrored(geometry, panel, starts.image[pair], ends.image[pair])
            usable[pair[shown], edge[shown]] = False
        pair, edge = np.nonzero(usable)
    points = edges.start[edge] + place[usable][:, None] * edges.way[edge]
    lifted = points + bender.lift[edge]
    legs = [Legs.between(geometry, side[pair], lifted) for side in (starts, ends)]
    keep = np.nonzero(legs[0].free & legs[1].free)[0]
    n, e = pair[keep], edge[keep]
    here = np.linalg.norm(points[keep] - starts.image[n], axis=1)
    there = np.linalg.norm(points[keep] - ends.image[n], axis=1)
    angles = near[2][n, e], far[2][n, e]
    gain = bender.bend(e, *angles, near[0][n, e] / here, here, there)
    for leg in legs:
        surface = leg.surface[keep]
        gain *= np.where(surface[:, None] >= 0, bender.factors[surface], 1.0)
    gain /= np.sqrt(here * there * (here + there))[:, None]
    mirrors = starts.mirrored[n].astype(int) + ends.mirrored[n]
    yield from zip(
        ends.owner[n],
        here + there,
        legs[0].facing[keep],
        legs[1].facing[keep],
        np.ones(len(keep), dtype=np.int64),
        gain,
        zip(e, np.full(len(keep), -1), strict=True),
        mirrors,
        strict=True,
    )


def _around(bender: Bender, side: Ends, which: IntArray) -> list[FloatArray]:
    """Return distance, place and angle of some ends, each looked at once."""
    some, back = np.unique(which, return_inverse=True)
    return [part[back] for part in bender.around(side.image[some])]
