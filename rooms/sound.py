"""What travels from an emitter to listeners, gathered until it is rendered.

Effects describe; nothing is computed sample by sample before `rooms.synthesis`.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rir import GainPattern, Pose, Poses
from rir.arrays import FloatArray, IntArray
from rooms.reflection import BounceChange, Bounces, Reflection, changed
from rooms.scene import Scene

if TYPE_CHECKING:
    from rooms.mesh import MeshGeometry

__all__ = [
    "Arrivals",
    "Budget",
    "Company",
    "Lattice",
    "Sound",
    "SurfaceParts",
    "Waves",
    "Work",
]


@dataclass(frozen=True)
class Work:
    """How finely the effects that are on are computed; the defaults are the finest."""

    rays: int | None = None
    """Rays per trace where none are asked for; None for the most that are usual."""
    images_until: float = float("inf")
    """Latest arrival of the single images of a box [s]: waves carry all later ones."""
    traced_until: float = float("inf")
    """Latest time that rays are traced for each pair [s]: all later energy is the mean
    of the room."""
    cells_per_wave: float = 7.0
    """Cells of the wave grid per wavelength at its highest frequency."""
    grid_until: float = float("inf")
    """Latest time that the wave grid is marched to [s]: all later sound is that of rays
    in the low octaves too."""
    moments: int = 8
    """Powers that place a pulse between two samples: 8 are exact to -100 dB, 4 to
    -40 dB (`rooms.kernels.pulses`)."""
    directions: int = 0
    """Cells along the edge of a cube of directions whose gains images look up; 0 for
    exact gains."""


_PER_CLASS = 3
"""Gauss nodes in a class of angles, in which reflections hardly bend."""


@dataclass(frozen=True)
class Budget:
    """How much work may be spent, and how long the response is."""

    sample_rate: int
    """Samples per second [Hz]."""
    n_samples: int
    """Length of the response."""
    max_order: int | None = None
    """Highest reflection order; None follows every image inside the response."""
    rays: int | None = None
    """Rays per trace; None lets the planner choose."""
    seed: int = 0
    """Key of everything random: equal seeds give equal responses."""
    work: Work = field(default_factory=Work)
    """How finely to compute what is not stated above."""

    @property
    def duration(self) -> float:
        """Length of the response [s]."""
        return self.n_samples / self.sample_rate


@dataclass(frozen=True, eq=False)
class Arrivals:
    """Wavefronts that reach the listeners, as a struct of arrays.

    Parameters
    ----------
    listener : ndarray, shape (n,)
        Number of the listener each one reaches.
    delay : ndarray, shape (n,)
        Time of flight [s].
    gain : ndarray, shape (n, bands)
        Amplitude, patterns and air left out.
    departure, arrival : ndarray, shape (n, 3)
        Unit vectors out of the emitter, and from the listener to where it comes from.
    order : ndarray, shape (n,)
        Number of reflections.
    corners : ndarray, shape (n, most reflections, 3), optional
        Points of reflection in their order from the emitter [m], then NaN; stated
        where an effect changes arrivals, None where they are not known.
    """

    listener: NDArray[np.int64]
    delay: FloatArray
    gain: FloatArray
    departure: FloatArray
    arrival: FloatArray
    order: NDArray[np.int64]
    corners: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Lattice:
    """All images of a shoebox up to an order and a time, without listing them."""

    size: FloatArray
    """Lengths of the box [m]. Shape (3,)."""
    reflection: FloatArray
    """Amplitude reflection factors of the walls. Shape (6, bands)."""
    max_order: int
    """Highest reflection order."""
    until: float
    """Latest arrival [s]."""
    from_order: int = 1
    """Lowest reflection order: those below are listed one by one."""
    fading: float = 0.0
    """How long before the latest arrival images begin to fade [s]."""
    by_angle: FloatArray | None = None
    """Reflection factors in equal classes of the cosine of incidence, where they
    differ. Shape (6, classes, bands)."""

    @property
    def farthest(self) -> float:
        """Distance [m] that no image within the order exceeds."""
        return (self.max_order + 1) * float(self.size.max()) + float(self.size.sum())


@dataclass(frozen=True, eq=False)
class Waves:
    """Random plane waves that stand for what no path describes singly.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Arrival for an emitter and a listener in the middle of the room [s].
    one, other : ndarray, shape (n, 3)
        Directions: each wave leaves along `one` and arrives from `other`, and has
        a twin that leaves along `other` and arrives from `one`.
    sign : ndarray, shape (n,)
        +1 or -1.
    amplitude : ndarray, shape (1 or listeners, steps, bands)
        Amplitude of one wave as a function of its arrival.
    step : float
        Spacing of `amplitude` [s].
    center : ndarray, shape (3,)
        Middle of the room [m].
    """

    time: FloatArray
    one: FloatArray
    other: FloatArray
    sign: FloatArray
    amplitude: FloatArray
    step: float
    center: FloatArray


@dataclass(frozen=True, eq=False)
class SurfaceParts:
    """The surfaces of a mesh in parts whose panels reflect alike.

    Parameters
    ----------
    mesh : MeshGeometry
        The room, with a surface for each part.
    surface : ndarray, shape (parts,)
        Surface of the scene that each is part of.
    panel : ndarray, shape (parts,)
        One of its panels, that stands for all.
    """

    mesh: "MeshGeometry"
    surface: IntArray
    panel: IntArray


@dataclass(eq=False)
class Company:
    """Emitters heard by the same listeners, whose rays are traced once for all."""

    emitters: FloatArray
    """Positions [m]. Shape (E, 3)."""
    traced: Any = None
    """What was traced between these and the listeners."""


@dataclass(eq=False)
class Sound:
    """Everything between one emitter and its listeners.

    Effects fill it in; `rooms.synthesis.render` turns it into samples. Mirror paths
    up to `listed_order` are in it one by one (0 the direct sound, -1 none), so what
    is traced leaves those out.
    """

    scene: Scene
    emitter: Pose
    listeners: Poses
    budget: Budget
    patterns: tuple[GainPattern, GainPattern] | None = None
    air_loss: FloatArray | None = None
    lattice: Lattice | None = None
    waves: Waves | None = None
    arrivals: list[Arrivals] = field(default_factory=list)
    listed_order: int = -1
    traced: Any = None
    bounce_changes: list[BounceChange] = field(default_factory=list)
    arrival_changes: list[Callable[[Arrivals], Arrivals]] = field(default_factory=list)
    finishers: list[Callable[[FloatArray], FloatArray]] = field(default_factory=list)
    parts: SurfaceParts | None = None
    """Surfaces in parts, where rays should tell panels of one surface apart."""
    fading_mirrors: bool = False
    """Whether mirrors fade towards the rims of faces, so that no sound bent at these
    rims has to make up for where they end."""
    company: Company | None = None
    """Emitters that share the listeners, this one among them; None if it is alone."""
    number: int = 0
    """Which of the company this emitter is."""

    @property
    def local(self) -> bool:
        """Whether some reflection depends on more than the surface it happens at."""
        return any(change.local for change in self.bounce_changes)

    def reflect(self, bounces: Bounces) -> Reflection:
        """Return what becomes of sound at each of several reflections."""
        kept = np.sqrt(1.0 - self.scene.absorption)[bounces.surface]
        return changed(kept, self.bounce_changes, bounces)

    def table(
        self, cosines: FloatArray, parts: SurfaceParts | None = None
    ) -> Reflection:
        """Return the reflection of each surface at some angles, its panels' mean.

        The ways before and after are the mean free path of the room: what rays,
        the mean flow of energy and images of high order ask for.

        Parameters
        ----------
        cosines : ndarray, shape (cosines,)
            Of the angle of incidence.
        parts : SurfaceParts, optional
            Parts to tell apart, in place of surfaces.

        Returns
        -------
        Reflection
            Of shape (surfaces or parts, cosines, bands).
        """
        surfaces, bands = self.scene.absorption.shape
        surface, panel = np.arange(surfaces), np.full(surfaces, -1)
        if parts is not None:
            surface, panel = parts.surface, parts.panel
        geometry = self.scene.geometry
        count = len(surface) * len(cosines)
        free = np.full(count, 4 * geometry.volume / geometry.areas.sum())
        bounces = Bounces(
            np.repeat(surface, len(cosines)),
            np.repeat(panel, len(cosines)),
            np.tile(cosines, len(surface)),
            free,
            free,
            np.full((count, 3), np.nan),
        )
        flat = self.reflect(bounces)
        shape = (len(surface), len(cosines), bands)
        return Reflection(flat.pressure.reshape(shape), flat.scattered.reshape(shape))

    def by_class(self, classes: int, parts: SurfaceParts | None = None) -> Reflection:
        """Return the reflection of each surface in equal classes of the cosine.

        Of sound from everywhere: the root of its mean energy, with the sign of the
        mean pressure, and the mean scattered share.

        Parameters
        ----------
        classes : int
            How many divide 0…1, from grazing on.
        parts : SurfaceParts, optional
            Parts to tell apart, in place of surfaces.

        Returns
        -------
        Reflection
            Of shape (surfaces or parts, classes, bands).
        """
        x, w = np.polynomial.legendre.leggauss(_PER_CLASS)
        cosines = (np.arange(classes)[:, None] + (x + 1) / 2) / classes
        # sound from everywhere brings energy in proportion to the cosine
        weights = w * cosines / (w * cosines).sum(axis=1, keepdims=True)
        table = self.table(cosines.ravel(), parts)
        shape = (len(table.pressure), *cosines.shape, table.pressure.shape[-1])
        mean, kept, diffuse = (
            np.einsum("cn,scnb->scb", weights, part.reshape(shape))
            for part in (table.pressure, table.pressure**2, table.diffuse)
        )
        scattered = np.divide(diffuse, kept, out=np.zeros_like(kept), where=kept > 0)
        return Reflection(np.copysign(np.sqrt(kept), mean), np.minimum(scattered, 1.0))

    @property
    def _mean(self) -> tuple[FloatArray, FloatArray]:
        """Kept and scattered shares of energy that arrives from everywhere."""
        cosines, weights = _DIFFUSE if self.local else (np.ones(1), np.ones(1))
        table = self.table(cosines)
        kept = np.einsum("c,scb->sb", weights, table.pressure**2)
        diffuse = np.einsum("c,scb->sb", weights, table.diffuse)
        return kept, diffuse

    @property
    def absorption(self) -> FloatArray:
        """Absorption for sound from everywhere, shape (surfaces, bands)."""
        return 1.0 - self._mean[0]

    @property
    def scattering(self) -> FloatArray | None:
        """Scattered share of what is reflected, (surfaces, bands); None if nothing."""
        if not self.bounce_changes:
            return None
        kept, diffuse = self._mean
        if not np.any(diffuse):
            return None
        return np.where(kept > 0, diffuse / np.maximum(kept, 1e-300), 0.0)

    @property
    def reflection(self) -> FloatArray:
        """Mirrored amplitude per surface and band, for sound from everywhere.

        Energy splits at a bounce into absorbed, scattered and specular shares
        (ISO 17497-1): the specular share is (1 - absorption)(1 - scattering).
        """
        if not self.local:
            return self.table(np.ones(1)).specular[:, 0]
        kept, diffuse = self._mean
        return np.sqrt(np.maximum(kept - diffuse, 0.0))


def _diffuse_rule() -> tuple[FloatArray, FloatArray]:
    """Return nodes and weights of the mean over directions of a diffuse field.

    Of the sound that meets a wall from everywhere, 2 cosine d(cosine) comes at each
    angle (Paris's formula).
    """
    x, w = np.polynomial.legendre.leggauss(16)
    cosines = (x + 1) / 2
    return cosines, w * cosines


_DIFFUSE = _diffuse_rule()
