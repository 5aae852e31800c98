"""What bends around the edges of one room, and how strongly."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rir.arrays import ComplexArray, FloatArray, IntArray
from rooms.diffraction.edges import Edges
from rooms.diffraction.utd import diffraction_coefficient
from rooms.mesh import MeshGeometry

__all__ = ["Bender"]

_STEPS = 60
"""Rounds in which two places on two edges settle by turns: 60 leave 0.4 µm of a way in
the built-in room where they settle slowest, 30 leave 0.1 mm."""
_SHARP = np.radians(200)
"""Edges that open less hardly bend sound: it goes on as along a wall."""
_ALONG = 1e-6
"""Angle [rad] within which a point lies on a face: a micrometre at a metre."""
_SETTLED = 1e-9
"""Places that move by less [m] have settled: ways are shortest there, and change by the
square of it."""


def _turned(angle: FloatArray) -> FloatArray:
    """Return angles from the first face on; a point on it has 0, not a full turn."""
    return np.where(angle < -_ALONG, angle + 2 * np.pi, np.maximum(angle, 0.0))


def _unit(vectors: FloatArray) -> FloatArray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


class Bender:
    """Finds and weighs the ways around the edges of one room.

    With `fading` mirrors no way is bent at a rim of the panel that shows one end to
    the other: what the rim does to the mirror is part of the mirror.
    """

    def __init__(
        self,
        geometry: MeshGeometry,
        edges: Edges,
        wave: FloatArray,
        factors: FloatArray,
        fading: bool = False,
    ) -> None:
        self.geometry, self.edges = geometry, edges
        self.wave, self.factors, self.fading = wave, factors, fading
        self.lift = 10 * geometry.tolerance * edges.bisector

    @cached_property
    def holds(self) -> NDArray[np.bool_]:
        """Whether an edge lies in the plane of a panel, shape (panels, edges)."""
        panels, edges = self.geometry.panels, self.edges
        ends = edges.start, edges.start + edges.length[:, None] * edges.way
        off = [np.abs(panels.normal @ p.T - panels.offset[:, None]) for p in ends]
        return np.maximum(*off) <= 10 * self.geometry.tolerance

    def around(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return distance, place and angle of points around edges, (N, edges) each."""
        edges = self.edges
        way = points[:, None] - edges.start
        along = np.einsum("nij,ij->ni", way, edges.way)
        x = np.einsum("nij,ij->ni", way, edges.tangent)
        y = np.einsum("nij,ij->ni", way, edges.normal)
        return np.hypot(x, y), along, _turned(np.arctan2(y, x))

    def bend(
        self,
        edge: IntArray,
        one: FloatArray,
        other: FloatArray,
        sine: FloatArray,
        near: FloatArray,
        far: FloatArray,
    ) -> ComplexArray:
        """Return the diffraction coefficients of n ways, shape (n, bands).

        Parameters
        ----------
        edge : ndarray, shape (n,)
            The edge each way bends around.
        one, other : ndarray, shape (n,)
            Angles of its ends around the edge [rad].
        sine : ndarray, shape (n,)
            Sine of the angle between way and edge.
        near, far : ndarray, shape (n,)
            Lengths on both sides of the edge [m].
        """
        spread = near * far * sine**2 / (near + far)
        faces = self.factors[self.edges.surfaces[edge]]
        parts = self.edges.opening[edge], one, other, sine, spread
        columns = (part[:, None] for part in parts)
        return diffraction_coefficient(
            *columns, wavenumber=self.wave, reflection=(faces[:, 0], faces[:, 1])
        )

    def twice(self, index: int, start: FloatArray, end: FloatArray) -> list[tuple]:
        """Return the ways around two edges."""
        edges = self.edges
        one, other = self._reached(start), self._reached(end)
        first, last = (grid.ravel() for grid in np.meshgrid(one, other, indexing="ij"))
        apart = first != last
        first, last = first[apart], last[apart]
        places = self._shortest(first, last, start, end)
        inside = (places >= 0) & (places < edges.length[[first, last]])
        usable = inside.all(axis=0)
        first, last, places = first[usable], last[usable], places[:, usable]
        p = edges.start[first] + places[0, :, None] * edges.way[first]
        q = edges.start[last] + places[1, :, None] * edges.way[last]
        up, vp = p + self.lift[first], q + self.lift[last]
        geometry = self.geometry
        free = geometry.sees(start, up) & geometry.sees(end, vp)
        keep = np.nonzero(free)[0]
        if len(keep):
            pairs = [geometry.sees(up[k], vp[k][None])[0] for k in keep]
            keep = keep[np.array(pairs, dtype=bool)]
        first, last, p, q = first[keep], last[keep], p[keep], q[keep]
        kept, total, gain = self._double(first, last, start, p, q, end)
        leave, reach = _unit(p[kept] - start), _unit(q[kept] - end)
        ways = zip(total, leave, reach, gain, first[kept], last[kept], strict=True)
        return [
            (index, length, out, back, 2, gains, (one, two), 0)
            for length, out, back, gains, one, two in ways
        ]

    def _reached(self, point: FloatArray) -> IntArray:
        """Return the sharp edges of which a point sees one of three places."""
        edges = self.edges
        angle = self.around(point[None])[2][0]
        sharp = (edges.opening > _SHARP) & (angle < edges.opening)
        which = np.nonzero(sharp)[0]
        seen = np.zeros(len(which), dtype=bool)
        for share in (0.1, 0.5, 0.9):
            along = share * edges.length[which, None] * edges.way[which]
            spots = edges.start[which] + along + self.lift[which]
            seen |= self.geometry.sees(point, spots)
        return which[seen]

    def _shortest(
        self, first: IntArray, last: IntArray, start: FloatArray, end: FloatArray
    ) -> FloatArray:
        """Return where on both edges the way is shortest, shape (2, pairs).

        Each place in turn is put where the way unfolds to a straight line; the
        length is convex in both, so this settles.
        """
        edges = self.edges
        places = np.stack([edges.length[first], edges.length[last]]) / 2
        for _ in range(_STEPS):
            before = places.copy()
            q = edges.start[last] + places[1, :, None] * edges.way[last]
            places[0] = self._straight(first, start[None], q)
            p = edges.start[first] + places[0, :, None] * edges.way[first]
            places[1] = self._straight(last, end[None], p)
            if np.abs(places - before).max(initial=0.0) < _SETTLED:
                break
        return places

    def _straight(self, which: IntArray, a: FloatArray, b: FloatArray) -> FloatArray:
        edges = self.edges
        start, way = edges.start[which], edges.way[which]
        along = [np.sum((point - start) * way, axis=-1) for point in (a, b)]
        away = [
            np.linalg.norm(point - start - s[:, None] * way, axis=-1)
            for point, s in zip((a, b), along, strict=True)
        ]
        total = np.maximum(away[0] + away[1], 1e-300)
        return (along[0] * away[1] + along[1] * away[0]) / total

    def _double(
        self,
        first: IntArray,
        last: IntArray,
        start: FloatArray,
        p: FloatArray,
        q: FloatArray,
        end: FloatArray,
    ) -> tuple[IntArray, FloatArray, ComplexArray]:
        """Return which ways bend around both edges, their lengths and gains."""
        edges = self.edges
        a, b, c = (np.linalg.norm(v, axis=1) for v in (p - start, q - p, end - q))
        bends = np.minimum(np.minimum(a, b), c) > self.geometry.tolerance
        angles = []
        for edge, before, after in ((first, start, q), (last, end, p)):
            both = [self._across(edge, point) for point in (before, after)]
            angles.append([np.minimum(part[1], edges.opening[edge]) for part in both])
            angles[-1].append(both[0][0])
            for part in both:
                bends &= part[1] <= edges.opening[edge] + _ALONG
        kept = np.nonzero(bends)[0]
        gain = np.ones((len(kept), len(self.wave)), complex)
        for edge, near, far, parts in (
            (first, a, b, angles[0]),
            (last, c, b, angles[1]),
        ):
            one, other, distance = (part[kept] for part in parts)
            sine = distance / near[kept]
            gain *= self.bend(edge[kept], one, other, sine, near[kept], far[kept])
        panels = edges.panels[first[kept]], edges.panels[last[kept]]
        shared = panels[0][:, :, None] == panels[1][:, None]
        # along a face the wave and its mirror image are one
        gain[shared.any(axis=(1, 2))] /= 2
        total = (a + b + c)[kept]
        return kept, total, gain / np.sqrt((a * b * c)[kept] * total)[:, None]

    def _across(self, edge: IntArray, points: FloatArray) -> tuple[FloatArray, ...]:
        """Return distance and angle of points around one edge each, shape (n,)."""
        edges = self.edges
        way = points - edges.start[edge]
        x = np.einsum("nj,nj->n", way, edges.tangent[edge])
        y = np.einsum("nj,nj->n", way, edges.normal[edge])
        return np.hypot(x, y), _turned(np.arctan2(y, x))
