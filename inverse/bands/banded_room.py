"""A box whose walls, air and devices differ from half octave to half octave."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inverse.bands.half_octaves import HalfOctaves, Interior, Kernels, LoopInput
from inverse.bands.occluders import Occluders
from inverse.bands.scatterers import Scatterers
from inverse.paths.room import MOST_IMAGES, BoxRoom
from rir import Poses
from rir.arrays import ComplexArray, FloatArray

__all__ = ["BandedRoom", "most_images"]


@dataclass(frozen=True, eq=False)
class BandedRoom:
    """Hold everything that renders the images of a box in half octaves.

    Parameters
    ----------
    room : BoxRoom
        Geometry, speed of sound, latency, order and reach.
    grid : HalfOctaves
        The bands.
    walls : ndarray, shape (bands, 6)
        Admittances over that of air where `angled`, else reflection factors.
    angled : bool
        Whether walls react locally: R = (cos - b) / (cos + b).
    loss : ndarray, shape (bands,)
        Attenuation of air, neper a metre.
    phase : ndarray, shape (bands,)
        Radians added to every arrival.
    emitting, listening : ndarray, shape (bands, harmonics)
        Patterns of the devices in their own frames.
    source : ndarray, shape (bins,)
        Complex spectrum of an arrival at 1 m.
    scatterers : Scatterers, optional
        Small objects.
    occluders : Occluders, optional
        What stands in the way.
    """

    room: BoxRoom
    grid: HalfOctaves
    walls: ComplexArray
    angled: bool
    loss: FloatArray
    phase: FloatArray
    emitting: FloatArray
    listening: FloatArray
    source: ComplexArray
    scatterers: Scatterers | None = None
    occluders: Occluders | None = None

    def render(self, emitters: Poses, listeners: Poses, n_samples: int) -> FloatArray:
        """Return the sum of all paths, shape (rows, n_samples)."""
        spectra = self.images(emitters, listeners) * self.source
        sound = np.fft.irfft(spectra, self.grid.size)[:, : self.grid.n_samples]
        out = np.zeros((len(emitters), n_samples))
        kept = min(n_samples, sound.shape[1])
        out[:, :kept] = sound[:, :kept]
        return out

    def images(self, emitters: Poses, listeners: Poses) -> ComplexArray:
        """Return the spectra of all paths of a flat source, shape (rows, bins)."""
        kernels = self.kernels(np.ones(len(self.grid.hertz)))
        return self.grid.joined(self.envelopes(emitters, listeners, kernels))

    def envelopes(
        self,
        emitters: Poses,
        listeners: Poses,
        kernels: Kernels,
        chosen: NDArray[np.bool_] | None = None,
    ) -> ComplexArray:
        """Return what the kernels make of all paths, shape (rows, total).

        Bands that are not `chosen` stay silent.
        """
        from inverse.bands.band_kernel import render_bands

        if chosen is None:
            chosen = np.ones(self.grid.bands, dtype=bool)
        out = np.zeros((len(emitters), self.grid.total), dtype=np.complex128)
        add: Any = render_bands
        taken = self.loop_input(emitters, listeners, kernels)
        add(*taken, most_images(self), chosen, out)
        if self.occluders is not None:
            self.occluders.add(taken, self.room.box, self.grid.centers, chosen, out)
        if self.scatterers is not None:
            self.scatterers.add(taken, self.room.box, chosen, out)
        return out

    def loop_input(
        self, emitters: Poses, listeners: Poses, kernels: Kernels
    ) -> LoopInput:
        """Return poses, room and kernels as the compiled loops take them."""
        interior = Interior(
            self.walls,
            self.angled,
            self.loss,
            self.emitting,
            self.listening,
            self.room.least,
            self.room.order,
        )
        ends, geometry = self.room.ends(emitters, listeners), self.geometry
        return LoopInput(ends, geometry, interior, kernels)

    def kernels(self, weight: FloatArray) -> Kernels:
        """Return arrivals as the bands hear them, their phase included."""
        plain = self.grid.kernels(weight)
        turn = np.exp(1j * self.phase)[:, None, None]
        return plain._replace(
            taps=np.ascontiguousarray(plain.taps * turn),
            slopes=np.ascontiguousarray(plain.slopes * turn),
        )

    @property
    def geometry(self) -> tuple[FloatArray, FloatArray, float, float, float]:
        """Corners, samples a metre, latency in samples, longest path in metres."""
        return self.room.geometry(self.grid.n_samples)

    def as_arrays(self) -> dict[str, np.ndarray]:
        """Return all but the geometry as plain arrays, for a file."""
        names = ("walls", "loss", "phase", "emitting", "listening", "source")
        return {
            **{name: getattr(self, name) for name in names},
            "angled": np.array(self.angled),
            "n_samples": np.array(self.grid.n_samples),
            **({} if self.scatterers is None else self.scatterers.as_arrays()),
            **({} if self.occluders is None else self.occluders.as_arrays()),
        }

    @classmethod
    def from_arrays(cls, room: BoxRoom, arrays: dict[str, np.ndarray]) -> "BandedRoom":
        """Rebuild what :meth:`as_arrays` returned."""
        parts: dict[str, Any] = dict(arrays)
        n_samples = int(parts.pop("n_samples"))
        parts["angled"] = bool(parts["angled"])
        parts["scatterers"] = Scatterers.from_arrays(parts)
        parts["occluders"] = Occluders.from_arrays(parts)
        return cls(room, HalfOctaves(room.sample_rate, n_samples), **parts)

    def reflection(self) -> FloatArray:
        """Return each wall's factor of energy at 60 degrees, shape (bands, 6)."""
        if not self.angled:
            return np.abs(self.walls) ** 2
        return np.abs((0.5 - self.walls) / (0.5 + self.walls)) ** 2


def most_images(banded: BandedRoom) -> int:
    """Return how many images a pair can have at most."""
    size = banded.room.box.high - banded.room.box.low
    reach = banded.geometry[-1]
    # each axis holds one image a room's width, and some more at the rim
    inside = 4 / 3 * np.pi * float(np.prod(reach / size + 1.5))
    return int(min(max(inside, 64), 4 * MOST_IMAGES))
