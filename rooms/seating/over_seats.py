"""Reflections off rows of seats: when they arrive, and what becomes of them.

Direct sound and its reflection off the seats arrive together where both graze the
rows, so what the ear meets is their sum: the dip is what the spherical wave off the
rows leaves of the direct sound. What passes over seats after a wall has its own pair:
off the wall, and off both. Where the floor is drawn and not the tops of the seats, the
reflection is brought forward to the time at which it comes off the tops.
"""

from dataclasses import dataclass, replace

import numpy as np

from rir.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rir.seats import SeatRows
from rooms.reflection import ECHO_FREQUENCIES, Bounces, Reflection, Spectra
from rooms.scene import Scene
from rooms.seating.areas import tops_above
from rooms.seating.troughs import acting_depth, troughs_of
from rooms.sound import Arrivals
from rooms.walls import octave_factors, spherical_factor

__all__ = ["OffTheTops", "OverSeats", "grazing_share"]

_ON_FLOOR = 1e-4
"""Distance within which a reflection happened on a floor [m]; far below a wave."""


@dataclass(frozen=True, eq=False)
class OverSeats:
    """The bounce change: spherical waves off rows of seats instead of plane ones."""

    scene: Scene
    panels: BoolArray
    """Whether each panel is part of an area of seats. Shape (panels,)."""
    local: bool = True

    def __call__(self, reflection: Reflection, bounces: Bounces) -> Reflection:
        """Change reflections off seats; means over a surface stay as they are."""
        met = bounces.placed & self.panels[bounces.panel]
        if not np.any(met):
            return reflection
        pressure, scattered = reflection.pressure.copy(), reflection.scattered.copy()
        spectra = _opened(reflection)
        for surface in np.unique(bounces.surface[met]):
            rows = self.scene.seats[surface]
            if rows is None:
                continue
            some = np.nonzero(met & (bounces.surface == surface))[0]
            factor = self._factor(int(surface), rows, bounces, some)
            pressure[some] = octave_factors(factor, self.scene.bands)
            scattered[some] = self._scattered(rows, scattered[some], bounces, some)
            spectra.factor[some], spectra.octaves[some] = factor, pressure[some]
            spectra.angled[some] = True
        return Reflection(pressure, scattered, spectra)

    def _factor(
        self, surface: int, rows: SeatRows, bounces: Bounces, some: IntArray
    ) -> ComplexArray:
        """Return factors of the listed reflections, shape (some, frequencies)."""
        scene = self.scene
        troughs = troughs_of(
            acting_depth(rows.back_m, rows.under_m),
            tuple(map(float, scene.absorption[surface])),
            tuple(map(float, scene.bands)),
            scene.speed_of_sound,
        )
        whole = bounces.before[some] + bounces.after[some]
        run, one, other = over_tops(
            bounces.cosine[some],
            bounces.before[some],
            bounces.after[some],
            tops_above(scene, rows),
        )
        mirrored = np.maximum(np.hypot(run, one + other), 1e-9)
        ways = (one + other) / mirrored, mirrored, scene.speed_of_sound
        # the list weighs the reflection by 1 / whole
        return (whole / mirrored)[:, None] * spherical_factor(
            troughs, ECHO_FREQUENCIES, *ways
        )

    def _scattered(
        self, rows: SeatRows, mean: FloatArray, bounces: Bounces, some: IntArray
    ) -> FloatArray:
        k = 2 * np.pi * self.scene.bands / self.scene.speed_of_sound
        # heights spread evenly over a trough have this standard deviation
        least = (2 * k * rows.depth_m / np.sqrt(12)) ** 2
        return grazing_share(mean, bounces.cosine[some], least)


@dataclass(frozen=True, eq=False)
class OffTheTops:
    """The arrival change: reflections off floors under seats come off their tops."""

    emitter: FloatArray
    """Position [m]. Shape (3,)."""
    listeners: FloatArray
    """Positions [m]. Shape (listeners, 3)."""
    floors: FloatArray
    """Triangles under seats [m]. Shape (triangles, 3, 3)."""
    lifts: FloatArray
    """Height of the tops above each of them [m]. Shape (triangles,)."""
    speed_of_sound: float

    def __call__(self, arrivals: Arrivals) -> Arrivals:
        """Shorten the delays of arrivals that were reflected under seats."""
        if arrivals.corners is None:
            return arrivals
        listener = self.listeners[arrivals.listener][:, None]
        stations = np.where(np.isnan(arrivals.corners), listener, arrivals.corners)
        starts = np.broadcast_to(self.emitter, listener.shape)
        legs = np.diff(np.concatenate([starts, stations, listener], axis=1), axis=1)
        lengths = np.linalg.norm(legs, axis=2)
        gone, whole = np.cumsum(lengths, axis=1), lengths.sum(axis=1)
        sooner = np.zeros(len(whole))
        for turn in range(arrivals.corners.shape[1]):
            lift, normal = self._met(arrivals.corners[:, turn])
            on = np.nonzero(lift > 0)[0]
            upright = np.abs(np.einsum("ij,ij->i", legs[on, turn], normal[on]))
            cosine = upright / np.maximum(lengths[on, turn], 1e-12)
            before = gone[on, turn]
            run, one, other = over_tops(cosine, before, whole[on] - before, lift[on])
            sooner[on] += whole[on] - np.hypot(run, one + other)
        return replace(arrivals, delay=arrivals.delay - sooner / self.speed_of_sound)

    def _met(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the lift and the normal of the floor under seats at each point."""
        lift, normals = np.zeros(len(points)), np.zeros((len(points), 3))
        for (a, b, c), height in zip(self.floors, self.lifts, strict=True):
            normal = np.cross(b - a, c - a)
            normal /= np.linalg.norm(normal)
            share = (points - a) @ np.linalg.pinv(np.array([b - a, c - a]))
            on = np.abs((points - a) @ normal) < _ON_FLOOR
            on &= np.all(share >= -1e-9, axis=1) & (share.sum(axis=1) <= 1 + 1e-9)
            lift[on], normals[on] = height, normal
        return lift, normals


def _opened(reflection: Reflection) -> Spectra:
    """Return a copy of what reflections are over frequency, for some to be replaced."""
    known = reflection.spectra
    if known is None:
        count, bands = reflection.pressure.shape
        factor = np.ones((count, len(ECHO_FREQUENCIES)), complex)
        return Spectra(factor, np.ones((count, bands)), np.zeros(count, bool))
    return Spectra(known.factor.copy(), known.octaves.copy(), known.angled.copy())


def over_tops(
    cosine: FloatArray, before: FloatArray, after: FloatArray, lift: FloatArray | float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the run of a reflected path along a floor, and both ends over the tops.

    Parameters
    ----------
    cosine, before, after : ndarray, shape (n,)
        Of the angle of incidence, and the ways to and from the floor [m].
    lift : ndarray or float
        Height of the tops above the floor [m]; ends below them count as at them.
    """
    run = (before + after) * np.sqrt(np.maximum(1 - cosine**2, 0.0))
    one, other = (np.maximum(way * cosine - lift, 0.0) for way in (before, after))
    return run, one, other


def grazing_share(
    mean: FloatArray, cosine: FloatArray, least: FloatArray
) -> FloatArray:
    """Return scattered shares at an angle of surfaces that scatter a mean share.

    Roughness is the less seen the flatter sound meets it (Rayleigh): the share is
    1 - exp(-x cosine²), with the x for which sound from everywhere loses the mean,
    1 - (1 - exp(-x)) / x.

    Parameters
    ----------
    mean : ndarray, shape (n, bands)
        Random-incidence share.
    cosine : ndarray, shape (n,)
        Of the angle of incidence.
    least : ndarray, shape (bands,)
        Least x: tables of scattering stop where all looks rough from above.
    """
    x = np.geomspace(1e-4, 1e4, 200)
    shares = 1 + np.expm1(-x) / x
    rough = np.interp(mean, np.append(0.0, shares), np.append(0.0, x))
    return -np.expm1(-np.maximum(rough, least) * cosine[:, None] ** 2)
