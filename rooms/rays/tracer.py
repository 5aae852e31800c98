"""Traces between places and puts together what they exchange."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray, IntArray
from rooms.mesh import MeshGeometry
from rooms.rays.corners import Corner, CornerRoom, find_close_chains
from rooms.rays.exchange import Exchange, FluxLayout
from rooms.rays.first import Hits, find_blurred, find_joined
from rooms.rays.patches import find_patches
from rooms.rays.places import Places
from rooms.rays.tracing import trace

__all__ = ["Tracer"]

Spread = tuple[FloatArray, FloatArray, FloatArray]
"""Mean, its variance, and the variance of its sum over time."""

_WEAKEST = 1e-9
"""A ray ends when every band has lost 90 dB."""

_THINNING = (0.3, 0.6)
"""Half of the rays end at each of these shares of the duration."""

_STAGE = 6.0
"""Rays that scatter are evened out every so many mean free paths: after more, few
carry all where one wall absorbs 0.6 and the others 0.05."""

_STAGES = 256
"""At most so often in a response."""

_MIRRORED = 0.6
"""Share of the rays that follow mirrors only, where surfaces scatter. Fewer (0.45)
halve the luck left in T30 but state it half as large again."""

_PATCHES = 1.0
"""Patches per root of the rays, within limits: finer where noise is lower."""

_FEWEST, _MOST = (
    64,
    8192,
)  # ten on each wall of a box; more take memory and meet few rays

_MEMORY = 40_000_000
"""Most numbers kept per place: fewer patches for long responses."""

_AT_ONCE = 8
"""So many places are exchanged in one go, if memory allows."""


@dataclass(frozen=True, eq=False)
class _Sent:
    """What the rays of one place did."""

    heard: Spread
    hits: Hits
    corner: Corner


class Tracer:
    """Traces between places.

    Parameters
    ----------
    geometry : MeshGeometry
        The room.
    shares : tuple of ndarray, shape (surfaces, classes, bands)
        Absorption and scattering, in equal classes of the cosine of incidence.
    per_bin : float
        Time steps per metre.
    rays : tuple of int
        Rays per pair, batches, seed, and reflections of mirror paths to leave out.
    bins : int
        Number of time steps.
    """

    def __init__(
        self,
        geometry: MeshGeometry,
        shares: tuple[FloatArray, FloatArray],
        per_bin: float,
        rays: tuple[int, int, int, int],
        bins: int,
    ) -> None:
        absorption, scattering = shares
        self.geometry, self.bins, self.per_bin = geometry, bins, per_bin
        self.classes, self.bands = absorption.shape[1:]
        # equal bands travel as one
        same = not np.any(np.ptp(absorption, axis=2) + np.ptp(scattering, axis=2))
        lanes = slice(0, 1) if same else slice(None)
        self.kept, self.scattering = (
            1.0 - absorption[..., lanes],
            scattering[..., lanes],
        )
        # of sound from everywhere, each class brings the more the steeper it is
        steepness = 2.0 * np.arange(self.classes) + 1.0
        weights = steepness / steepness.sum()
        count, self.batches, self.seed, self.skip = rays
        self.diffuse = self.kept * self.scattering
        self.mean_diffuse = np.einsum("c,scb->sb", weights, self.diffuse)
        self.scatters = bool(np.any(self.diffuse))
        share = _MIRRORED if self.scatters else 1.0
        each = count / (2 * self.batches)
        self.each = [max(1, round(part * each)) for part in (share, 1.0 - share)]
        if not self.scatters:
            self.each[1] = 0
        self.ways = np.concatenate(
            [
                spread_ways(self.batches * part).reshape(part, self.batches, 3)
                for part in self.each
            ]
        ).swapaxes(0, 1)
        self.reach, self.segments = bins / per_bin, 0
        self._prepare(count)

    def _prepare(self, count: int) -> None:
        bands = self.kept.shape[2]
        wanted = 1
        if self.scatters:
            wide = FluxLayout(1, self.bins, bands).wide
            bearable = _MEMORY / (2 * self.batches * self.bins * wide)
            most = min(_MOST, max(_FEWEST, bearable))
            wanted = int(np.clip(_PATCHES * np.sqrt(count), _FEWEST, most))
        patches = find_patches(self.geometry, wanted)
        self.layout = FluxLayout(len(patches), self.bins, bands)
        self.records, self.bases = patches.records(self.geometry), self.layout.bases
        scales = tuple(4 * np.pi / max(part, 1) for part in self.each)
        self.share = self.mean_diffuse[patches.surface]
        self.share /= np.pi * patches.area[:, None]
        self.exchange = Exchange(self.layout, self.share, (scales[0], scales[1]))
        span = self.layout.wide * self.layout.group
        self.start = np.zeros(span)
        self.start[:bands] = 1.0
        self.tables = [
            np.ascontiguousarray(
                np.pad(table.reshape(-1, bands), [(0, 0), (0, span - bands)])
            )
            for table in (self.kept, self.scattering)
        ]
        self.even = not np.any(np.ptp(self.scattering, axis=2))
        self.corners = CornerRoom(
            self.geometry,
            self.records,
            np.ascontiguousarray(self.kept),
            np.ascontiguousarray(self.scattering),
            self.share,
            np.sqrt(float(patches.area.mean())),
            self.per_bin,
            self.bins,
        )
        self.stages = self._find_stages()

    def _find_stages(self) -> list[tuple[FloatArray, IntArray]]:
        """Return where rays of each kind are evened out [m], and how many go on."""
        free = 4 * self.geometry.volume / max(float(self.geometry.areas.sum()), 1e-9)
        count = int(np.clip(self.reach / max(_STAGE * free, 1e-9), 1, _STAGES))
        stops = self.reach * np.arange(1, count + 1) / count
        thinned = np.searchsorted(np.array(_THINNING) * self.reach, stops, "right")
        targets = np.maximum(1, np.rint(self.each[1] * 0.5**thinned)).astype(np.int64)
        stops[-1] = np.inf
        return [(stops[-1:], targets[-1:]), (stops, targets)]

    def between(self, here: Places, there: Places) -> Spread:
        """Return energy, its error and that of its sum, first axis `here`.

        Shapes are (H, T, bands, bins), the same, and (H, T, bands).
        """
        if len(here) > len(there):
            energy, square, total = self._between(there, here)
            parts = (np.swapaxes(part, 0, 1) for part in (energy, square, total))
            energy, square, total = parts
        else:
            energy, square, total = self._between(here, there)
        gaps = here.points[:, None] - there.points
        for row, column in np.argwhere(~np.any(gaps, axis=-1)):
            # the rays of one place are not independent of themselves
            pair = self._between(here.one(row), there.one(column), salt=1)
            for target, part in zip((energy, square, total), pair, strict=True):
                target[row, column] = part[0, 0]
        return self._shaped(energy, square, total)

    def _between(self, here: Places, there: Places, salt: int = 0) -> Spread:
        bands = self.kept.shape[2]
        shape = (len(here), len(there), self.bins, bands)
        energy, square = np.zeros(shape), np.zeros(shape)
        spread = energy, square, np.zeros((*shape[:2], bands))
        if not len(here):
            return spread
        size = 2 * self.batches * np.prod(self.layout.shape)
        few = int(np.clip(2 * _MEMORY // size, 1, min(_AT_ONCE, len(there))))
        flux, more = self._room(len(here)), self._room(few)
        sent = [self._leave(here, k, there, flux[k]) for k in range(len(here))]
        for row, one in enumerate(sent):
            _gain([part[row] for part in spread], one.heard)
        for start in range(0, len(there), few):
            some = range(start, min(start + few, len(there)))
            more[:] = 0.0
            back = [self._leave(there, k, here, more[k - start], salt) for k in some]
            for k, one in zip(some, back, strict=True):
                _gain([part[:, k] for part in spread], one.heard)
            if self.scatters:
                met = self._meet(sent, flux, back, more[: len(back)])
                _gain([part[:, start : some.stop] for part in spread], met)
        return spread

    def _room(self, places: int) -> NDArray[np.float32]:
        shape = self.layout.shape if self.scatters else (0, 0, 0)
        return np.zeros((places, self.batches, 2, *shape), dtype=np.float32)

    def _shaped(
        self, energy: FloatArray, square: FloatArray, total: FloatArray
    ) -> Spread:
        whole = (*total.shape[:2], self.bands)
        long = (*energy.shape[:3], self.bands)
        energy, square = (
            np.swapaxes(np.broadcast_to(part, long), 2, 3).copy()
            for part in (energy, square)
        )
        return energy, np.sqrt(square), np.sqrt(np.broadcast_to(total, whole))

    def _leave(
        self,
        places: Places,
        number: int,
        there: Places,
        flux: NDArray[np.float32],
        salt: int = 0,
    ) -> _Sent:
        """Send the rays of a place; add what they meet to `flux`."""
        origin = places.points[number]
        rng = np.random.default_rng([self.seed, salt, *_bits(origin)])
        rotation, triangle = np.linalg.qr(rng.standard_normal((3, 3)))
        rotation = rotation * np.sign(np.diag(triangle))
        hits = Hits.none(origin, self.ways @ rotation, self.each[0])
        grids = np.zeros((self.batches, len(there), self.bins, self.kept.shape[2]))
        none = np.zeros((0, *grids.shape[2:]))
        for batch in range(self.batches):
            keys = rng.integers(2**64, size=2, dtype=np.uint64)
            self._trace(hits, batch, 0, there, keys[0], grids[batch], flux)
            if self.scatters:
                self._trace(hits, batch, 1, there, keys[1], none, flux)
        # rays share the energy of 1/d², 4 pi over all directions; half of both ways
        heard = _spread(grids * (2 * np.pi / self.each[0]))
        return _Sent(heard, hits, self._corner(hits, rng))

    def _corner(self, hits: Hits, rng: np.random.Generator) -> Corner:
        ways = hits.ways[:, : hits.mirrored]
        key = rng.integers(2**64, dtype=np.uint64)
        return Corner(self.corners, hits.origin, ways, key)

    def _trace(
        self,
        hits: Hits,
        batch: int,
        kind: int,
        there: Places,
        key: np.uint64,
        grid: FloatArray,
        flux: NDArray[np.float32],
    ) -> None:
        geometry = self.geometry
        some = slice(0, self.each[0]) if kind == 0 else slice(self.each[0], None)
        met = hits.face[batch, some], hits.patch[batch, some], hits.length[batch, some]
        kept, scattering = self.tables
        self.segments += trace(
            geometry.hierarchy.arrays,
            geometry.panels.of_face,
            self.records,
            self.bases,
            kept,
            scattering,
            self.classes,
            self.start,
            self.even,
            hits.origin,
            hits.ways[batch, some],
            kind == 1,
            there.balls,
            self.per_bin,
            self.skip,
            1e-12 * geometry.diagonal,
            np.array(_THINNING if kind == 0 else ()) * self.reach,
            self.stages[kind],
            _WEAKEST,
            key,
            grid,
            flux[batch, kind].reshape(-1),
            self.bins,
            self.layout.wide,
            met,
        )

    def _meet(
        self,
        here: list[_Sent],
        flux: NDArray[np.float32],
        there: list[_Sent],
        other: NDArray[np.float32],
    ) -> Spread:
        """Return what two groups of places exchange by scattering surfaces."""
        mean, rows = self.exchange.between(flux, other)
        geometry, batches = self.geometry, self.batches
        room = (
            geometry.hierarchy.arrays,
            geometry.panels.of_face,
            geometry.tables.planes,
            geometry.face_surface,
            1e-9 * geometry.diagonal,
        )
        block, scale = self.exchange.block, 4 * np.pi / self.each[0]
        times = self.per_bin, self.bins
        energy, square = np.zeros(mean.shape), np.zeros(mean.shape)
        total = np.zeros((*mean.shape[:2], mean.shape[-1]))
        for i, one in enumerate(here):
            for j, two in enumerate(there):
                ends = one.hits, two.hits
                exact = find_joined(room, self.diffuse, *ends, *times)
                chains = find_close_chains(one.corner, two.corner, scale)
                if chains is None:
                    close = find_blurred(self.share, *ends, scale, *times)
                else:
                    exact, close = exact + chains[0], chains[1]
                start = self._soonest(*ends)
                late = mean[i, j] - close.mean(axis=0) / 2
                late[:start] = 0.0
                # the delays of two bins add to one bin or the next
                late[1:] = (late[1:] + late[:-1]) / 2
                late[0] /= 2
                energy[i, j] = np.maximum(late, 0.0) + exact.mean(axis=0)
                known = _summed(exact - close, block)
                changes = known + rows[i, j, :, : known.shape[1]]
                variance = changes.var(axis=0) / (batches - 1)
                square[i, j] = _shared(variance, energy[i, j], block)
                total[i, j] = changes.sum(axis=-2).var(axis=0) / (batches - 1)
        return energy, square, total

    def _soonest(self, here: Hits, there: Hits) -> int:
        """Return the time step before which nothing arrives."""
        gap = np.sqrt(np.sum((here.origin - there.origin) ** 2))
        return max(int(gap * self.per_bin) - 1, 0)


def _gain(targets: list[FloatArray], parts: Spread) -> None:
    for target, part in zip(targets, parts, strict=True):
        target += part


def _spread(rows: FloatArray) -> Spread:
    """Return mean, its variance, and that of its sum over time (last axis but one)."""
    freedom = len(rows) - 1
    total = rows.sum(axis=-2).var(axis=0) / freedom
    return rows.mean(axis=0), rows.var(axis=0) / freedom, total


def _summed(rows: FloatArray, block: int) -> FloatArray:
    """Return sums over blocks of the last axis but one."""
    count = -(-rows.shape[-2] // block)
    pad = [(0, 0)] * (rows.ndim - 2) + [(0, count * block - rows.shape[-2]), (0, 0)]
    long = np.pad(rows, pad)
    split = long.reshape(*rows.shape[:-2], count, block, rows.shape[-1])
    return split.sum(axis=-2)


def _shared(blocks: FloatArray, energy: FloatArray, block: int) -> FloatArray:
    """Return the variances of blocks, shared out to time steps by their energy."""
    whole = _summed(energy, block)
    part = np.divide(blocks, whole, out=np.zeros_like(whole), where=whole > 0)
    return np.repeat(part, block, axis=0)[: len(energy)] * energy


def _bits(point: FloatArray) -> list[int]:
    # adding zero turns -0 into 0
    return (point + 0.0).view(np.uint32).tolist()


def spread_ways(count: int) -> FloatArray:
    """Return directions that fill the sphere evenly.

    R. Swinbank, R. Purser, Q. J. R. Meteorol. Soc. 132, 1769 (2006): Fibonacci grid.
    """
    index = np.arange(count) + 0.5
    up = 1 - 2 * index / count
    turn = np.pi * (1 + np.sqrt(5)) * index
    flat = np.sqrt(1 - up**2)
    return np.column_stack([flat * np.cos(turn), flat * np.sin(turn), up])
