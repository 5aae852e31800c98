"""A box-shaped room: walls, air, devices and the pulse of an arrival."""

from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import numpy as np

from inverse.paths.bank import PulseBank
from inverse.paths.oriented_box import OrientedBox
from rir import Poses
from rir.arrays import FloatArray

__all__ = ["BoxRoom", "PathRoom", "turns_of"]

MOST_IMAGES = 6000  # listed within the reach: a row then costs some milliseconds
LONG_TAPS, ROWS_AT_ONCE = 64, 16  # longer pulses are rendered by moments
FRONT = 32  # samples before the first, for latencies below zero
OMNI = np.array([np.sqrt(4 * np.pi)])


Shape = TypeVar("Shape")
_NUMBERS = ("speed_of_sound", "latency_s", "sample_rate", "reach_m")
_ARRAYS = ("walls", "emitting", "listening")


@dataclass(frozen=True, eq=False)
class PathRoom(Generic[Shape]):
    """Hold everything that renders the paths of a room of some shape.

    Parameters
    ----------
    shape : OrientedBox or Polyhedron
        The walls.
    speed_of_sound, latency_s : float
        Metres per second; seconds before every arrival.
    walls : ndarray, shape (W,)
        Reflection factors.
    emitting, listening : ndarray, shape (harmonics,)
        Patterns of the two devices, in their own frames.
    bank : PulseBank
        Shape of an arrival.
    sample_rate : float
        Hertz.
    order : int
        Most reflections of a path.
    reach_m : float
        Longest path.
    """

    shape: Shape
    speed_of_sound: float
    latency_s: float
    walls: FloatArray
    emitting: FloatArray
    listening: FloatArray
    bank: PulseBank
    sample_rate: float
    order: int = 200
    reach_m: float = 40.0

    @property
    def scale(self) -> float:
        """Samples a metre."""
        return self.sample_rate / self.speed_of_sound

    def reach(self, n_samples: int) -> float:
        """Return how long paths that arrive within so many samples are, metres."""
        end = n_samples / self.scale - self.latency_s * self.speed_of_sound
        return max(min(self.reach_m, end + self.bank.lead / self.scale), 0.1)

    def as_arrays(self) -> dict[str, Any]:
        """Return all but the shape as plain arrays, for a file."""
        pulse = {"taps": self.bank.taps, "lead": self.bank.lead, "order": self.order}
        return {name: getattr(self, name) for name in (*_NUMBERS, *_ARRAYS)} | pulse

    @staticmethod
    def parts_of(arrays: dict[str, np.ndarray]) -> dict[str, Any]:
        """Return the parts, by name, of what :meth:`as_arrays` returned."""
        return {
            "bank": PulseBank(arrays["taps"], int(arrays["lead"])),
            "order": int(arrays["order"]),
            **{name: float(arrays[name]) for name in _NUMBERS},
            **{name: arrays[name] for name in _ARRAYS},
        }


@dataclass(frozen=True, eq=False)
class BoxRoom(PathRoom[OrientedBox]):
    """Render the images of a box, of `least` reflections or more."""

    least: int = 0

    @property
    def box(self) -> OrientedBox:
        """The walls."""
        return self.shape

    def render(
        self, emitters: Poses, listeners: Poses, n_samples: int, bank=None
    ) -> FloatArray:
        """Return the sum of all images, shape (rows, n_samples)."""
        from inverse.paths.lattice_kernel import render_rows

        chosen = bank or self.bank
        if chosen.taps.shape[1] > LONG_TAPS:
            return self._by_moments(emitters, listeners, n_samples, chosen)
        out = np.zeros((len(emitters), n_samples))
        render_rows(
            *self.ends(emitters, listeners),
            *self.geometry(n_samples),
            self.walls,
            self.emitting,
            self.listening,
            chosen.taps,
            chosen.lead,
            self.least,
            self.order,
            out,
        )
        return out

    def moments(
        self, emitters: Poses, listeners: Poses, n_grid: int, n_samples: int
    ) -> FloatArray:
        """Return all images by the moments of their arrivals' fractions.

        Parameters
        ----------
        emitters, listeners : Poses
            The ends of the rows.
        n_grid : int
            Length of the grid, which starts at sample -FRONT.
        n_samples : int
            Length of the responses, for the reach.

        Returns
        -------
        ndarray, shape (rows, moments, n_grid)
        """
        from inverse.paths.grid_kernel import lay_rows

        low, high, scale, latency, reach = self.geometry(n_samples)
        grid = np.zeros((len(emitters), self.bank.taps.shape[0], n_grid))
        lay_rows(
            *self.ends(emitters, listeners),
            low,
            high,
            scale,
            latency + FRONT,
            reach,
            self.walls,
            self.emitting,
            self.listening,
            self.least,
            self.order,
            grid,
        )
        return grid

    def _by_moments(
        self, emitters: Poses, listeners: Poses, n_samples: int, bank: PulseBank
    ) -> FloatArray:
        """Render through a filter a moment, a few rows at a time."""
        from scipy.fft import irfft, next_fast_len, rfft

        out = np.empty((len(emitters), n_samples))
        taps, lead = bank.taps.shape[1], bank.lead + FRONT
        n_grid = n_samples + lead
        size = next_fast_len(n_grid + taps, real=True)
        shape = np.asarray(rfft(bank.taps, size))
        for start in range(0, len(emitters), ROWS_AT_ONCE):
            some = slice(start, start + ROWS_AT_ONCE)
            grid = self.moments(emitters[some], listeners[some], n_grid, n_samples)
            spectra = np.asarray(rfft(grid, size))
            sound = np.asarray(irfft(np.einsum("rmf,mf->rf", spectra, shape), size))
            out[some] = sound[:, lead : lead + n_samples]
        return out

    def ends(
        self, emitters: Poses, listeners: Poses
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return both ends and the turns into the devices, for a kernel."""
        return (
            self.box.inside(emitters.positions),
            self.box.inside(listeners.positions),
            turns_of(emitters, self.box.axes),
            turns_of(listeners, self.box.axes),
        )

    def geometry(
        self, n_samples: int
    ) -> tuple[FloatArray, FloatArray, float, float, float]:
        """Return corners, scale, latency and reach, for a kernel."""
        latency = self.latency_s * self.sample_rate
        return self.box.low, self.box.high, self.scale, latency, self.reach(n_samples)

    def with_order(self, least: int, most: int) -> "BoxRoom":
        """Return the room with images of some orders only."""
        return replace(self, least=least, order=most)


def turns_of(poses: Poses, axes: FloatArray) -> FloatArray:
    """Return matrices from the frame of a box to each device's, (rows, 3, 3)."""
    x, y, z, w = poses.orientations.T
    rows = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    # columns of a rotation are the device's axes, so its transpose leads back
    return np.ascontiguousarray(np.einsum("jin,aj->nia", rows, axes))
