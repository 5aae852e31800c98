"""Energy over time between places in a room, by ray tracing, exactly symmetric."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rir.arrays import FloatArray
from rir.errors import SceneError
from rooms.mesh import MeshGeometry
from rooms.rays.places import find_places

__all__ = ["EnergyHistogram", "trace_energy"]


@dataclass(frozen=True, eq=False)
class EnergyHistogram:
    """Energy that arrives in each step of time.

    Energies are in the unit of a response whose direct sound is 1/d: without any
    loss, 4 pi c time_step / V arrive in a step once the room is filled.
    """

    energy: FloatArray
    """Energy per bin; bin k holds arrivals from k to k + 1 time steps. Shape (E, L,
    bands, bins)."""
    error: FloatArray
    """Standard error, from independent batches of rays. That of a block of bins, an
    eighth of all, is shared out to its bins as if these were independent. Shape (E, L,
    bands, bins)."""
    total_error: FloatArray
    """Standard error of the sum over time. Shape (E, L, bands)."""
    time_step: float
    """Width of a bin [s]."""
    segments: int
    """Ray segments that were traced."""


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
    absorption, scattering : array_like, shape (surfaces, [classes,] bands)
        Shares of the energy arriving; scattering is a share of what is reflected. If
        stated by classes of the cosine of incidence, these divide 0…1 evenly, from
        grazing on; what patches exchange takes their mean over a diffuse field.
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
    from rooms.rays.tracer import Tracer

    tracer = Tracer(
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
    table = table[:, None] if table.ndim == 2 else table
    if table.ndim != 3 or table.shape[0] != geometry.surfaces:
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
