"""Energy over time between places in a room, by ray tracing, exactly symmetric."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir.errors import SceneError
from rooms.mesh import MeshGeometry
from rooms.rays.exchange import Flux, exchanged, transformed
from rooms.rays.patches import find_patches
from rooms.rays.places import Places, find_places

__all__ = ["EnergyHistogram", "trace_energy"]

FloatArray = NDArray[np.float64]
_WEAKEST = 1e-9
"""A ray ends when every band has lost 90 dB."""

_THINNING = (0.2, 0.4)
"""Half of the rays end at each of these shares of the duration."""

_MIRRORED = 0.4
"""Share of the rays that follow mirrors only, where surfaces scatter."""

_PATCHES = 1.5
"""Patches per root of the rays, within limits: finer where noise is lower."""

_FEWEST, _MOST = 64, 8192

_MEMORY = 40_000_000
"""Most numbers kept per place: fewer patches for long responses."""


@dataclass(frozen=True, eq=False)
class EnergyHistogram:
    """Energy that arrives in each step of time.

    Energies are in the unit of a response whose direct sound is 1/d: without any
    loss, 4 pi c time_step / V arrive in a step once the room is filled.

    Parameters
    ----------
    energy : ndarray, shape (E, L, bands, bins)
        Energy per bin; bin k holds arrivals from k to k + 1 time steps.
    error : ndarray, shape (E, L, bands, bins)
        Standard error, from independent batches of rays.
    total_error : ndarray, shape (E, L, bands)
        Standard error of the sum over time.
    time_step : float
        Width of a bin [s].
    segments : int
        Ray segments that were traced.
    """

    energy: FloatArray
    error: FloatArray
    total_error: FloatArray
    time_step: float
    segments: int


def trace_energy(
    geometry: MeshGeometry,
    absorption: ArrayLike,
    scattering: ArrayLike,
    emitters: ArrayLike,
    listeners: ArrayLike,
    *,
    rays: int,
    duration: float,
    time_step: float,
    speed_of_sound: float,
    skip_specular_up_to: int = 0,
    batches: int = 4,
    seed: int = 0,
) -> EnergyHistogram:
    """Trace energy between all pairs of emitters and listeners.

    Each place sends rays, which depend on the seed and the place only. What mirrors
    pass on is heard where it passes the places of the other kind, and a pair gets
    the mean of both ways; what is scattered is exchanged on patches of the surfaces,
    see `rooms.rays.exchange`. So exchanging emitters and listeners gives the same
    histogram to the last bit, at any number of rays. The air absorbs nothing here:
    its loss depends on time alone.

    Parameters
    ----------
    geometry : MeshGeometry
        The room.
    absorption, scattering : array_like, shape (surfaces, bands)
        Shares of the energy arriving; scattering is a share of what is reflected.
    emitters, listeners : array_like, shape (E, 3), (L, 3)
        Positions [m].
    rays : int
        Rays per pair, half of them from each end.
    duration, time_step : float
        Length of the histogram and of its bins [s].
    speed_of_sound : float
        Speed of sound [m/s].
    skip_specular_up_to : int
        Leave out mirror paths of this many reflections or fewer: those that are
        listed one by one. -1 leaves out nothing, 0 the direct sound.
    batches : int
        Independent groups of rays, for the error; at least 3.
    seed : int
        Key of all random numbers.

    Raises
    ------
    SceneError
        If shares, counts or times cannot be used.

    References
    ----------
    M. Vorländer, Auralization, 2nd ed., 2020, chapter 11 (ray tracing, detection);
    E. Veach, PhD thesis, Stanford University, 1997, chapter 10 (both ends);
    A. Wilkie et al., Comput. Graph. Forum 33(4), 123 (2014): one way, many bands.

    Examples
    --------
    >>> room = MeshGeometry.box((6, 5, 3))
    >>> share = np.full((6, 1), 0.2)
    >>> places = [[1.7, 3.1, 1.4]], [[4, 1, 2]]
    >>> options = dict(rays=800, duration=0.1, time_step=0.01, speed_of_sound=343.2)
    >>> there = trace_energy(room, share, share, *places, **options)
    >>> back = trace_energy(room, share, share, *places[::-1], **options)
    >>> bool(np.all(there.energy == back.energy))
    True
    """
    shares = [
        _shares(geometry, name, values)
        for name, values in (("absorption", absorption), ("scattering", scattering))
    ]
    if shares[0].shape != shares[1].shape:
        raise SceneError("absorption and scattering must have the same bands")
    bins = _bins(duration, time_step)
    if rays < 1 or batches < 1:
        raise SceneError(
            f"tracing needs 1 or more rays and batches, not {rays} and {batches}"
        )
    tracer = _Tracer(
        geometry,
        (shares[0], shares[1]),
        1.0 / (speed_of_sound * time_step),
        (rays, max(batches, 3), seed, skip_specular_up_to),
        bins,
    )
    ends = find_places(geometry, emitters), find_places(geometry, listeners)
    energy, error, total_error = tracer.between(*ends)
    return EnergyHistogram(energy, error, total_error, time_step, tracer.segments)


def _shares(geometry: MeshGeometry, name: str, values: ArrayLike) -> FloatArray:
    table = np.asarray(values, dtype=float)
    if table.ndim != 2 or table.shape[0] != geometry.surfaces:
        raise SceneError(
            f"{name} has shape {table.shape}; the mesh has {geometry.surfaces} surfaces"
        )
    if not np.all((table >= 0) & (table <= 1)):
        raise SceneError(f"{name} must lie in 0…1")
    return table


def _bins(duration: float, time_step: float) -> int:
    if not (0 < time_step < np.inf and 0 < duration < np.inf):
        raise SceneError(
            f"duration and time step must be positive, not {duration} s, {time_step} s"
        )
    return max(1, int(np.ceil(duration / time_step - 1e-9)))


def spread_ways(count: int, rng: np.random.Generator) -> FloatArray:
    """Return directions that fill the sphere evenly, turned at random.

    R. Swinbank, R. Purser, Q. J. R. Meteorol. Soc. 132, 1769 (2006): Fibonacci grid.
    """
    index = np.arange(count) + 0.5
    up = 1 - 2 * index / count
    turn = np.pi * (1 + np.sqrt(5)) * index
    flat = np.sqrt(1 - up**2)
    ways = np.column_stack([flat * np.cos(turn), flat * np.sin(turn), up])
    rotation, triangle = np.linalg.qr(rng.standard_normal((3, 3)))
    return np.ascontiguousarray(ways @ (rotation * np.sign(np.diag(triangle))))


class _Tracer:
    """Traces between places, batch by batch."""

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
        self.bands = absorption.shape[1]
        # equal bands travel as one
        same = not np.any(np.ptp(absorption, axis=1) + np.ptp(scattering, axis=1))
        lanes = slice(0, 1) if same else slice(None)
        self.kept = np.ascontiguousarray(1.0 - absorption[:, lanes])
        self.scattering = np.ascontiguousarray(scattering[:, lanes])
        count, self.batches, self.seed, self.skip = rays
        self.scatters = bool(np.any(self.kept * self.scattering))
        share = _MIRRORED if self.scatters else 1.0
        each = count / (2 * self.batches)
        self.each = [max(1, round(part * each)) for part in (share, 1.0 - share)]
        rng = np.random.default_rng(self.seed)
        self.ways = [spread_ways(self.batches * part, rng) for part in self.each]
        self.reach = bins / per_bin
        self.segments = 0
        self.patches = find_patches(geometry, 1)
        if self.scatters:
            bearable = _MEMORY / (4 * self.batches * bins * self.kept.shape[1])
            most = min(_MOST, max(_FEWEST, bearable))
            wanted = float(np.clip(_PATCHES * np.sqrt(count), _FEWEST, most))
            self.patches = find_patches(geometry, int(wanted))
            surface = self.patches.surface
            share = (self.kept * self.scattering)[surface]
            self.share = share / (np.pi * self.patches.area[:, None])
            self.active = np.nonzero(self.share.any(axis=1))[0]

    def between(
        self, here: Places, there: Places
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return energy, its error and that of its sum, first axis `here`."""
        shape = (len(here), len(there), self.bins, self.kept.shape[1])
        energy, square = np.zeros(shape), np.zeros(shape)
        total = np.zeros((*shape[:2], shape[3]))
        sent = [self._leave(place, there) for place in here.points]
        for row, (heard, _) in enumerate(sent):
            for target, part in zip((energy, square, total), heard, strict=True):
                target[row] += part
        for column, place in enumerate(there.points):
            heard, flux = self._leave(place, here)
            for target, part in zip((energy, square, total), heard, strict=True):
                target[:, column] += part
            for row, (_, other) in enumerate(sent):
                if other is None or flux is None:
                    continue
                met = self._meet(other, flux)
                for target, part in zip((energy, square, total), met, strict=True):
                    target[row, column] += part
        return self._shaped(energy, square, total)

    def _shaped(
        self, energy: FloatArray, square: FloatArray, total: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        whole = (*total.shape[:2], self.bands)
        long = (*energy.shape[:3], self.bands)
        energy, square = (
            np.swapaxes(np.broadcast_to(part, long), 2, 3).copy()
            for part in (energy, square)
        )
        return energy, np.sqrt(square), np.sqrt(np.broadcast_to(total, whole))

    def _leave(
        self, origin: FloatArray, there: Places
    ) -> tuple[tuple[FloatArray, FloatArray, FloatArray], Flux | None]:
        """Return half of what is heard by mirrors with its variances, and the flux."""
        grids, mirrored, scattered = [], [], []
        for batch in range(self.batches):
            grid = np.zeros((len(there), self.bins, self.kept.shape[1]))
            flux = self._trace(origin, there, batch, grid, scatter=False)
            grids.append(grid)
            if flux is not None:
                mirrored.append(flux)
                none = np.zeros((0, *grid.shape[1:]))
                scattered.append(self._trace(origin, there, batch, none, scatter=True))
        # the mean of both ways
        heard = _spread(np.array(grids) / 2, 1.0)
        return heard, Flux(mirrored, scattered) if self.scatters else None

    def _trace(
        self,
        origin: FloatArray,
        there: Places,
        batch: int,
        grid: FloatArray,
        *,
        scatter: bool,
    ) -> Any:
        from rooms.rays.tracing import trace

        geometry, each = self.geometry, self.each[int(scatter)]
        key = np.random.default_rng((self.seed, batch, int(scatter)))
        count = len(self.patches) if self.scatters else 0
        flux = np.zeros((count, *grid.shape[1:]), dtype=np.float32)
        self.segments += trace(
            geometry.hierarchy.arrays,
            geometry.panels.of_face,
            geometry.tables.planes,
            geometry.face_surface,
            self.kept,
            self.scattering,
            origin,
            self.ways[int(scatter)][batch :: self.batches],
            scatter,
            there.balls,
            self.patches.arrays,
            self.per_bin,
            self.skip,
            1e-12 * geometry.diagonal,
            np.array(_THINNING) * self.reach,
            _WEAKEST,
            key.integers(2**64, dtype=np.uint64),
            grid,
            flux,
        )
        # rays share the energy of 1/d²: 4 pi over all directions
        grid *= 4 * np.pi / each
        if not self.scatters:
            return None
        some = flux if len(self.active) == len(flux) else flux[self.active]
        return transformed(some, 4 * np.pi / each)

    def _meet(
        self, here: Flux, there: Flux
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        rows = exchanged(here, there, self.share[self.active], self.bins)
        # rows share all batches but their own
        own = (self.batches - 1) / (self.batches - 2)
        return _spread(rows, 4 * own**2)


def _spread(
    rows: FloatArray, scale: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return mean, its variance, and that of its sum over time (last axis but one)."""
    mean = rows.mean(axis=0)
    freedom = (len(rows) - 1) / scale
    total = rows.sum(axis=-2).var(axis=0) / freedom
    return np.maximum(mean, 0.0), rows.var(axis=0) / freedom, total
