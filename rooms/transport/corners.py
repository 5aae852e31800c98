"""Scattered sound between places in the same corner of a box.

Functions on whole walls are too smooth for what close walls scatter to each other and
to places that are as close. So such chains are followed point by point, and what the
functions make of them is taken back.
"""

from functools import cached_property
from typing import Any

import numpy as np

from rir.arrays import FloatArray
from rooms.transport.box import BoxTransport

__all__ = ["BoxCorner", "in_one_corner"]

_COPIES = 8
"""Chains of each hit: their chance moves the level in a corner by 0.02 dB,
and a metre along its edge by 0.1 dB; four times as many would halve that."""

_ENDS = 6
"""Room for so many ends of each chain, on average."""

_NEAR = 0.25
"""Walls nearer than this share of the mean free path are close: where functions on
walls are off by 0.05 dB."""


def in_one_corner(box: BoxTransport, one: FloatArray, other: FloatArray) -> bool:
    """Tell whether two places are close to each other and to the same two walls.

    At least one of these must scatter.
    """
    near = _NEAR * box.mean_free_path
    if np.linalg.norm(one - other) > box.close_length:
        return False
    gaps = np.stack([[p, box.size - p] for p in (one, other)]).max(axis=0)
    close = (gaps < near).T.ravel()
    return int(close.sum()) > 1 and bool(np.any(box.scattered[close]))


class BoxCorner:
    """What keeps close to a place, found when it is asked for.

    Parameters
    ----------
    box : BoxTransport
        The box.
    position, nearest : ndarray, shape (3,)
        The place [m], and which walls are the nearer ones.
    hits : tuple of ndarray
        What its rays meet, see `rooms.transport.single.collect_hits`.
    kept : ndarray, shape (6, classes, lanes)
        What close mirrors leave of each class of hits.
    close : ndarray, shape (freq * lanes, 2, functions)
        What the hits leave on the walls.
    """

    def __init__(
        self,
        box: BoxTransport,
        position: FloatArray,
        nearest: Any,
        hits: tuple[Any, ...],
        kept: FloatArray,
        close: FloatArray,
    ) -> None:
        self.box, self.position, self.nearest = box, position, nearest
        self.hits, self.kept, self.close = hits, kept, close

    @cached_property
    def chains(self) -> tuple[Any, Any]:
        """Ends of chains of the place, and what arrives there."""
        from rooms.transport.chains import follow_chains

        box = self.box
        room = _ENDS * _COPIES * len(self.hits[0])
        ends = np.empty((room, 6), dtype=np.float32)
        energies = np.empty((room, box.lanes), dtype=np.float32)
        count = follow_chains(
            box.size,
            self.hits,
            self.kept * box.scattered[:, None],
            (box.scattered, box.mirrored),
            _COPIES,
            box.close_length,
            np.uint64(1),
            ends,
            energies,
        )
        # what many places keep
        return ends[:count].copy(), energies[:count].copy()

    @cached_property
    def smooth(self) -> FloatArray:
        """What functions make of all chains behind the close hits, as `close`."""
        from rooms.transport.chains import LINKS

        given = (self.close[:, 0] + 1j * self.close[:, 1])[..., None]
        chain = np.zeros_like(given)
        for _ in range(LINKS - 1):
            chain = self.box.close_exchange @ (given + chain)
        return np.stack([chain[..., 0].real, chain[..., 0].imag], axis=1)

    def heard(self, other: "BoxCorner", step: float, steps: int) -> FloatArray:
        """Return energy per second of chains that end at another place, over time."""
        from rooms.transport.chains import join_chains

        box, out = self.box, np.zeros((steps, self.box.lanes))
        per_bin = 1 / (box.speed * step)
        factors = other.kept * box.scattered[:, None] * (16 * np.pi / step)
        place = other.position, other.nearest, box.mirrors
        join_chains(box.size, self.chains, *place, factors, per_bin, out)
        return out
