"""Energy over time between places in a room, by ray tracing, exactly symmetric."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir.errors import SceneError
from rooms.mesh import MeshGeometry
from rooms.rays.places import Places, find_places

__all__ = ["EnergyHistogram", "trace_energy"]

FloatArray = NDArray[np.float64]
_WEAKEST = 1e-9
"""A ray ends when every band has lost 90 dB."""


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
    batches: int = 8,
    seed: int = 0,
) -> EnergyHistogram:
    """Trace energy between all pairs of emitters and listeners.

    Each place sends rays to all places of the other kind; a pair gets the mean of
    both ways. Rays depend on the seed and the place they leave, so exchanging
    emitters and listeners gives the same histogram to the last bit, at any number
    of rays. The air absorbs nothing here: its loss depends on time alone.

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
        Independent groups of rays, for the error.
    seed : int
        Key of all random numbers.

    Raises
    ------
    SceneError
        If shares, counts or times cannot be used.

    References
    ----------
    M. Vorländer, Auralization, 2nd ed., 2020, chapter 11 (ray tracing, detection);
    D. Schröder, PhD thesis, RWTH Aachen, 2011, section 5.3 (diffuse rain).
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
    each = -(-rays // (2 * batches)) if batches > 0 else 0
    if rays < 1 or batches < 1:
        raise SceneError(
            f"tracing needs 1 or more rays and batches, not {rays} and {batches}"
        )
    tracer = _Tracer(
        geometry,
        1.0 - shares[0],
        shares[1],
        1.0 / (speed_of_sound * time_step),
        (each, batches, seed, skip_specular_up_to),
        bins,
    )
    ends = find_places(geometry, emitters), find_places(geometry, listeners)
    there, there_spread, there_total = tracer.between(ends[0], ends[1])
    back, back_spread, back_total = tracer.between(ends[1], ends[0])
    return EnergyHistogram(
        (there + back.swapaxes(0, 1)) / 2,
        np.sqrt(there_spread + back_spread.swapaxes(0, 1)) / 2,
        np.sqrt(there_total + back_total.swapaxes(0, 1)) / 2,
        time_step,
        tracer.segments,
    )


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
    """Traces from places to places, batch by batch."""

    def __init__(
        self,
        geometry: MeshGeometry,
        kept: FloatArray,
        scattered: FloatArray,
        per_bin: float,
        rays: tuple[int, int, int, int],
        bins: int,
    ) -> None:
        tables, panels = geometry.tables, geometry.panels
        self.scene = (
            geometry.hierarchy.arrays,
            panels.of_face,
            tables.blockers,
            tables.rims,
            tables.planes,
        )
        self.geometry, self.bins, self.per_bin = geometry, bins, per_bin
        self.bands = kept.shape[1]
        # equal bands travel as one
        same = np.all(kept == kept[:, :1]) and np.all(scattered == scattered[:, :1])
        lanes = slice(0, 1) if same else slice(None)
        self.kept = np.ascontiguousarray(kept[:, lanes])
        self.scattered = np.ascontiguousarray(scattered[:, lanes])
        self.each, self.batches, self.seed, self.skip = rays
        self.segments = 0

    def between(
        self, here: Places, there: Places
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return mean, squared error and that of the sum, first axis `here`."""
        shape = (len(here), len(there), self.bands, self.bins)
        mean, spread = np.zeros(shape), np.zeros(shape)
        total = np.zeros(shape[:3])
        for index, origin in enumerate(here.points):
            results = self._leave(origin, there)
            for target, result in zip((mean, spread, total), results, strict=True):
                target[index] = result
        return mean, spread, total

    def _leave(
        self, origin: FloatArray, there: Places
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        from rooms.rays.tracing import trace

        bands, n = self.kept.shape[1], self.batches
        grid = np.zeros((len(there), self.bins, bands))
        mean, square = np.zeros_like(grid), np.zeros_like(grid)
        sums = np.zeros((n, len(there), bands))
        for batch in range(n):
            rng = np.random.default_rng((self.seed, batch))
            grid[:] = 0.0
            self.segments += trace(
                *self.scene,
                self.geometry.face_surface,
                self.kept,
                self.scattered,
                origin,
                spread_ways(self.each, rng),
                there.balls,
                self.per_bin,
                self.skip,
                1e-12 * self.geometry.diagonal,
                (1e-2 * self.geometry.diagonal) ** 2,
                _WEAKEST,
                rng.integers(2**64, dtype=np.uint64),
                grid,
            )
            # rays share the energy of 1/d²: 4 pi over all directions
            grid *= 4 * np.pi / self.each
            mean += grid / n
            square += grid * grid / n
            sums[batch] = grid.sum(axis=1)
        freedom = max(n - 1, 1)
        spread = np.maximum(square - mean * mean, 0.0) / freedom
        total = sums.var(axis=0) / freedom
        return tuple(
            np.broadcast_to(part, (*part.shape[:-1], self.bands)).swapaxes(1, -1)
            if part.ndim == 3
            else np.broadcast_to(part, (len(there), self.bands))
            for part in (mean, spread, total)
        )  # pyright: ignore[reportReturnType]
