"""Sound between places that are close to the same corner.

Patches blend what meets them. Where two places are closer to several surfaces than a
patch is wide, they lose most of what one surface mirrors or scatters and another
scatters. So all chains of scattering that keep close are joined exactly there, and
what patches make of them is taken back, see `rooms.rays.chains`.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from rir.arrays import FloatArray, IntArray
from rooms.mesh import MeshGeometry
from rooms.mesh.nearness import nearest_gap
from rooms.rays.chains import blur_chains, follow_chains, join_chains

__all__ = ["Corner", "CornerRoom", "find_close_chains"]

_WALLS = 3
"""Most surfaces that count as close, the nearest: those of the corner of a box."""

_LONGEST = 4.0
"""Chains are no longer than so many sides of a patch: from there on patches do."""


@dataclass(frozen=True, eq=False)
class CornerRoom:
    """What chains ask of a room.

    Parameters
    ----------
    geometry : MeshGeometry
        The room.
    records : ndarray, shape (F, 16)
        See `rooms.rays.patches`.
    kept, scattering : ndarray, shape (surfaces, classes, bands)
        Shares, in equal classes of the cosine of incidence.
    share : ndarray, shape (patches, bands)
        What patches hand on.
    width : float
        Side of a square patch [m].
    per_bin, bins : float, int
        Time steps per metre, and their number.
    """

    geometry: MeshGeometry
    records: FloatArray
    kept: FloatArray
    scattering: FloatArray
    share: FloatArray
    width: float
    per_bin: float
    bins: int

    @cached_property
    def room(self) -> tuple[Any, ...]:
        """The room as compiled loops take it."""
        geometry = self.geometry
        return geometry.hierarchy.arrays, geometry.panels.of_face, self.records

    @cached_property
    def tables(self) -> tuple[FloatArray, FloatArray]:
        """What surfaces scatter and mirror of what arrives."""
        return self.kept * self.scattering, self.kept * (1.0 - self.scattering)

    def near(self, point: FloatArray) -> IntArray:
        """Return the panels closer to a point than a patch is wide, the nearest."""
        panels = self.geometry.panels
        height = np.abs(panels.normal @ point - panels.offset)
        gap = np.linalg.norm(panels.center - point, axis=1) - panels.radius
        some = np.nonzero((height < self.width) & (gap < self.width))[0]
        gaps = np.array([self._gap(int(panel), point) for panel in some])
        order = np.argsort(gaps, kind="stable")
        return some[order[gaps[order] < self.width][:_WALLS]]

    def _gap(self, panel: int, point: FloatArray) -> float:
        panels = self.geometry.panels
        own = panels.faces[slice(*panels.face_start[panel : panel + 2])]
        return nearest_gap(self.geometry.corners[own], point)

    def does(self, kind: int, panel: int) -> bool:
        """Tell whether a panel scatters (kind 0) or mirrors (kind 1) anything."""
        panels = self.geometry.panels
        own = panels.faces[slice(*panels.face_start[panel : panel + 2])]
        return bool(np.any(self.tables[kind][self.geometry.face_surface[own]]))


class Corner:
    """What is close to a place, and what its rays do there.

    Parameters
    ----------
    room : CornerRoom
        The room.
    origin, ways : ndarray, shape (3,), (batches, rays, 3)
        The place [m], and its rays.
    key : int
        Its random numbers begin with it.
    """

    def __init__(
        self, room: CornerRoom, origin: FloatArray, ways: FloatArray, key: np.uint64
    ) -> None:
        self.room, self.origin, self.ways, self.key = room, origin, ways, key

    @cached_property
    def near(self) -> IntArray:
        """Panels close to the place, at least two of which one scatters, or none."""
        near = self.room.near(self.origin)
        lit = len(near) > 1 and any(self.room.does(0, panel) for panel in near)
        return near if lit else near[:0]

    @cached_property
    def images(self) -> tuple[FloatArray, IntArray, IntArray]:
        """The place and its images, panels on their way, and image of each image.

        Shapes are (N, 3), (N, 2) and (N, panels); see `rooms.rays.chains`.
        """
        panels, near = self.room.geometry.panels, self.near
        mirrors = [k for k, panel in enumerate(near) if self.room.does(1, panel)]
        ways: list[tuple[int, ...]] = [(), *((k,) for k in mirrors)]
        ways += [(j, k) for j in mirrors for k in mirrors if j != k]
        images = np.tile(self.origin, (len(ways), 1))
        walls = np.full((len(ways), 2), -1)
        after = np.full((len(ways), len(near)), -1)
        for row, way in enumerate(ways):
            for step, k in enumerate(way):
                normal = panels.normal[near[k]]
                height = images[row] @ normal - panels.offset[near[k]]
                images[row] -= 2.0 * height * normal
                walls[row, step] = near[k]
            for k in mirrors:
                if (*way, k) in ways:
                    after[row, k] = ways.index((*way, k))
        return images, walls, after

    @cached_property
    def chains(self) -> tuple[Any, ...]:
        """What `rooms.rays.chains.follow_chains` finds."""
        room = self.room
        return follow_chains(
            room.room,
            (room.kept, room.scattering),
            self.origin,
            np.ascontiguousarray(self.ways),
            self.near,
            self.images[2],
            _LONGEST * room.width,
            room.bins / room.per_bin,
            1e-12 * room.geometry.diagonal,
            self.key,
        )

    @cached_property
    def order(self) -> IntArray:
        """Chains, patch by patch."""
        return np.argsort(self.chains[2][:, 1], kind="stable")


def find_close_chains(
    here: Corner, there: Corner, scale: float
) -> tuple[FloatArray, FloatArray] | None:
    """Return the energy of close chains and what patches make of it, or None.

    Shapes are (batches, bins, bands). The first leaves out what is scattered once and
    otherwise straight; the second holds it, in rows as those of
    `rooms.rays.first.find_blurred`. None if the places are not in one corner.

    Parameters
    ----------
    here, there : Corner
        The places.
    scale : float
        Energy of a ray if those of one batch were all.
    """
    room = here.room
    gap = np.linalg.norm(here.origin - there.origin)
    if gap > _LONGEST * room.width or not (len(here.near) and len(there.near)):
        return None
    if tuple(there.origin) < tuple(here.origin):
        # sums in one order, whichever end is which
        here, there = there, here
    batches, each = here.ways.shape[:2]
    shape = (batches, room.bins, room.kept.shape[2])
    rows, blurred = np.zeros((2, *shape)), np.zeros(shape)
    diagonal = room.geometry.diagonal
    for target, one, other in ((rows[0], here, there), (rows[1], there, here)):
        join_chains(
            room.room,
            room.tables,
            one.chains,
            *other.images[:2],
            room.per_bin,
            each,
            1e-9 * diagonal,
            1e-12 * diagonal,
            target,
        )
    ends = (here.order, there.order), here.chains, there.chains
    blur_chains(*ends, room.share, room.per_bin, blurred)
    return rows[0] + rows[1], blurred * (scale * scale / batches)
