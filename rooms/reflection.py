"""What a surface does to sound that meets it, and what effects may change of it.

At each reflection energy splits into an absorbed, a scattered and a mirrored share
(ISO 17497-1). Effects that change the split append a `BounceChange` to the sound;
whoever reflects sound - lists of mirror paths, rays, the mean flow of energy - asks the
same chain of changes.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from rir.arrays import BoolArray, ComplexArray, FloatArray, IntArray

__all__ = [
    "ECHO_FREQUENCIES",
    "BounceChange",
    "Bounces",
    "Reflection",
    "ScatteredShare",
    "Spectra",
    "changed",
    "path_gains",
]


ECHO_FREQUENCIES = np.geomspace(60.0, 15000.0, 64)
"""Where reflections are asked for [Hz]: eight an octave, all that octaves reach."""


@dataclass(frozen=True, eq=False)
class Bounces:
    """Reflections that sound undergoes, as a struct of arrays.

    Parameters
    ----------
    surface : ndarray, shape (n,)
        Surface that is met: the row of its material.
    panel : ndarray, shape (n,)
        Flat region that is met: the wall of a box, the panel of a mesh; -1 where a
        mean over the surface is asked for.
    cosine : ndarray, shape (n,)
        Cosine of the angle of incidence, 0…1.
    before, after : ndarray, shape (n,)
        Way from the emitter to the reflection, and from there to the listener [m].
    point : ndarray, shape (n, 3)
        Where the surface is met [m]; NaN where a mean is asked for.
    way : ndarray, shape (n, 3), optional
        Unit vectors of the sound that arrives at the surface; None where they are not
        known: in boxes, and where a mean is asked for.
    """

    surface: IntArray
    panel: IntArray
    cosine: FloatArray
    before: FloatArray
    after: FloatArray
    point: FloatArray
    way: FloatArray | None = None

    def __len__(self) -> int:
        return len(self.surface)

    @property
    def placed(self) -> BoolArray:
        """Which are single reflections with a place of their own, no means."""
        return (self.panel >= 0) & ~np.isnan(self.point[:, 0])


@dataclass(frozen=True, eq=False)
class Spectra:
    """Reflections over frequency, beside what octaves say of them.

    Parameters
    ----------
    factor : ndarray, shape (n, frequencies)
        Factor of the pressure at `ECHO_FREQUENCIES`.
    octaves : ndarray, shape (n, bands)
        The same as the octaves have it, which it stands for.
    angled : ndarray of bool, shape (n,)
        Which reflections are meant; both factors are 1 elsewhere.
    """

    factor: ComplexArray
    octaves: FloatArray
    angled: BoolArray

    def along(self, paths: int, rows: IntArray) -> "Spectra":
        """Return the products along paths, to which reflections belong by `rows`."""
        factor = np.ones((paths, self.factor.shape[1]), complex)
        octaves = np.ones((paths, self.octaves.shape[1]))
        angled = np.zeros(paths, bool)
        np.multiply.at(factor, rows, self.factor)
        np.multiply.at(octaves, rows, self.octaves)
        np.logical_or.at(angled, rows, self.angled)
        return Spectra(factor, octaves, angled)


@dataclass(frozen=True, eq=False)
class Reflection:
    """What becomes of sound at each of several reflections.

    Parameters
    ----------
    pressure : ndarray, shape (n, bands)
        Factor of the sound pressure if nothing were scattered; negative where the
        phase turns.
    scattered : ndarray, shape (n, bands)
        Share of the reflected energy that goes elsewhere than the mirror sends it.
    spectra : Spectra, optional
        Where surfaces turn the phase: what `pressure` stands for, over frequency.
    """

    pressure: FloatArray
    scattered: FloatArray
    spectra: Spectra | None = None

    @property
    def specular(self) -> FloatArray:
        """Factor of the mirrored sound pressure, shape (n, bands)."""
        return self.pressure * np.sqrt(1.0 - self.scattered)

    @property
    def diffuse(self) -> FloatArray:
        """Share of the arriving energy that is scattered, shape (n, bands)."""
        return self.pressure**2 * self.scattered

    def with_scattering(self, share: FloatArray) -> "Reflection":
        """Return the reflection with a share of what is still mirrored scattered too.

        Parameters
        ----------
        share : ndarray, shape (n, bands)
            Share of the mirrored energy.
        """
        return replace(self, scattered=self.scattered + (1.0 - self.scattered) * share)


class BounceChange(Protocol):
    """One effect's change of what happens at reflections."""

    @property
    def local(self) -> bool:
        """Whether the angle, the place or the ways matter, not the surface alone."""
        ...

    def __call__(self, reflection: Reflection, bounces: Bounces) -> Reflection:
        """Return the changed reflections; exchanging the ends must change nothing."""
        ...


@dataclass(frozen=True, eq=False)
class ScatteredShare:
    """Scattering by rough surfaces: a share of what each surface reflects."""

    share: FloatArray
    """Scattered share of the reflected energy. Shape (surfaces, bands)."""
    local: bool = False

    def __call__(self, reflection: Reflection, bounces: Bounces) -> Reflection:
        """Take the share of the surface met."""
        return reflection.with_scattering(self.share[bounces.surface])


def changed(
    pressure: FloatArray, changes: Iterable[BounceChange], bounces: Bounces
) -> Reflection:
    """Return reflections after all changes.

    Parameters
    ----------
    pressure : ndarray, shape (n, bands)
        Factor of the pressure before any change.
    changes : iterable of BounceChange
        In order of application.
    bounces : Bounces
        The n reflections.
    """
    reflection = Reflection(pressure, np.zeros_like(pressure))
    for change in changes if len(bounces) else ():
        reflection = change(reflection, bounces)
    return reflection


def path_gains(
    length: FloatArray,
    rows: IntArray,
    bounces: Bounces,
    reflect: Callable[[Bounces], Reflection],
    nearest: float = 0.01,
) -> tuple[FloatArray, Spectra | None]:
    """Return the amplitude of paths whose reflections are asked for one by one.

    Parameters
    ----------
    length : ndarray, shape (paths,)
        Length of each path [m].
    rows : ndarray, shape (n,)
        Path that each reflection belongs to.
    bounces : Bounces
        All n reflections.
    reflect : callable
        What becomes of them, as `rooms.sound.Sound.reflect`.
    nearest : float
        Lengths below this [m] count as this: no transducer is a point.

    Returns
    -------
    gain : ndarray, shape (paths, bands)
        Signed amplitudes.
    spectra : Spectra or None
        Of the paths, where surfaces turn the phase.
    """
    reflection = reflect(bounces)
    factor = reflection.specular
    gain = np.ones((len(length), factor.shape[1]))
    np.multiply.at(gain, rows, factor)
    gain /= np.maximum(length, nearest)[:, None]
    spectra = reflection.spectra
    return gain, None if spectra is None else spectra.along(len(length), rows)
