"""Walls whose reflection depends on the angle, as one change of a bounce."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from rir.arrays import ComplexArray, FloatArray
from rir.walls import WallModel, octave_frequencies, pressure_factor
from rooms.reflection import ECHO_FREQUENCIES, Bounces, Reflection, Spectra
from rooms.scene import Scene
from rooms.walls.spherical import spherical_factor

__all__ = ["AngledWalls", "angled_walls", "octave_factors"]

_LEAST = 1e-6
"""Pressure factors of octaves are no smaller, -120 dB: others are divided by them."""


@dataclass(frozen=True, eq=False)
class AngledWalls:
    """Reflection by admittance, for the surfaces that state one.

    Listed paths get the spherical wave's factor over frequency, means and images of
    high order the plane wave's: per octave the root of its mean energy, with the sign
    of its mean.
    """

    walls: Mapping[int, WallModel]
    """Model of each surface that has one."""
    bands: FloatArray
    """Octave centres [Hz]. Shape (bands,)."""
    speed_of_sound: float
    """Speed of sound [m/s]."""
    local: bool = True
    _known: dict[tuple[int, bytes], FloatArray] = field(default_factory=dict)

    def __call__(self, reflection: Reflection, bounces: Bounces) -> Reflection:
        """Return reflections with the pressure that the walls leave."""
        pressure = reflection.pressure.copy()
        placed = bounces.placed
        listed = bool(np.any(placed))
        shape = (len(bounces), len(ECHO_FREQUENCIES))
        factor = np.ones(shape if listed else (0, 0), complex)
        for row, wall in self.walls.items():
            met = bounces.surface == row
            mean, single = met & ~placed, met & placed
            if np.any(mean):
                pressure[mean] = self.means(wall, bounces.cosine[mean])
            if np.any(single):
                lengths = bounces.before[single] + bounces.after[single]
                ways = bounces.cosine[single], lengths
                factor[single] = spherical_factor(
                    wall, ECHO_FREQUENCIES, *ways, self.speed_of_sound
                )
                pressure[single] = octave_factors(factor[single], self.bands)
        if not listed:
            return replace(reflection, pressure=pressure)
        angled = np.isin(bounces.surface, list(self.walls)) & placed
        octaves = np.where(angled[:, None], pressure, 1.0)
        return replace(
            reflection, pressure=pressure, spectra=Spectra(factor, octaves, angled)
        )

    def means(self, wall: WallModel, cosines: FloatArray) -> FloatArray:
        """Return the plane wave's signed factors per octave, (cosines, bands)."""
        different, place = np.unique(cosines, return_inverse=True)
        key = id(wall), different.tobytes()
        if key not in self._known:
            f = octave_frequencies(self.bands)
            factor = pressure_factor(wall, f, different[:, None, None])
            size = np.sqrt(np.mean(np.abs(factor) ** 2, axis=-1))
            mean = np.mean(factor.real, axis=-1)
            self._known[key] = np.where(mean < 0, -size, size)
        return self._known[key][place]


def octave_factors(factor: ComplexArray, bands: FloatArray) -> FloatArray:
    """Return signed factors per octave of spectra at `ECHO_FREQUENCIES`.

    The root of the mean energy, with the sign of the mean.

    Parameters
    ----------
    factor : ndarray of complex, shape (n, frequencies)
        Factors of the pressure.
    bands : ndarray, shape (bands,)
        Octave centres [Hz].
    """
    distance = np.abs(np.log2(ECHO_FREQUENCIES / bands[:, None]))
    # an impulse has as much energy as an octave has hertz
    weight = np.where(distance <= 0.5, ECHO_FREQUENCIES, 0.0)
    weight /= weight.sum(axis=1, keepdims=True)
    size = np.sqrt(np.abs(factor) ** 2 @ weight.T)
    sign = np.where(factor.real @ weight.T < 0, -1.0, 1.0)
    return sign * np.maximum(size, _LEAST)


@lru_cache(maxsize=8)
def angled_walls(scene: Scene) -> AngledWalls:
    """Return the change that a scene's walls make, whose means are found once."""
    return AngledWalls(scene.walls, scene.bands, scene.speed_of_sound)
