"""A box-shaped room: walls, air, devices and the pulse of an arrival."""

from dataclasses import dataclass, field, replace

import numpy as np

from inverse.paths.bank import PulseBank
from inverse.paths.oriented_box import OrientedBox
from rir import Poses
from rir.arrays import FloatArray

__all__ = ["BoxRoom", "turns_of"]

GEOMETRY = 11  # parameters before the walls': turn 3, low 3, high 3, speed, latency
MOST_IMAGES = 6000  # listed within the reach: a row then costs some milliseconds
LONG_TAPS, ROWS_AT_ONCE = 64, 16  # longer pulses are rendered by moments
FRONT = 32  # samples before the first, for latencies below zero
OMNI = np.array([np.sqrt(4 * np.pi)])


@dataclass(frozen=True, eq=False)
class BoxRoom:
    """Hold everything that renders the images of a box.

    Parameters
    ----------
    box : OrientedBox
        The walls.
    speed_of_sound, latency_s : float
        Metres per second; seconds before every arrival.
    walls : ndarray, shape (6,)
        Reflection factors.
    emitting, listening : ndarray, shape (harmonics,)
        Patterns of the two devices, in their own frames.
    bank : PulseBank
        Shape of an arrival.
    sample_rate : float
        Hertz.
    order : int
        Most reflections of an image.
    reach_m : float
        Longest path.
    """

    box: OrientedBox
    speed_of_sound: float
    latency_s: float
    walls: FloatArray
    emitting: FloatArray
    listening: FloatArray
    bank: PulseBank
    sample_rate: float
    order: int = 200
    reach_m: float = 40.0
    least: int = field(default=0)

    @property
    def scale(self) -> float:
        """Samples a metre."""
        return self.sample_rate / self.speed_of_sound

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
        end = n_samples / self.scale - self.latency_s * self.speed_of_sound
        reach = min(self.reach_m, end + self.bank.lead / self.scale)
        return (
            self.box.low,
            self.box.high,
            self.scale,
            self.latency_s * self.sample_rate,
            max(reach, 0.1),
        )

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
