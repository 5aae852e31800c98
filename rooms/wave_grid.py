"""Low frequencies by the wave equation on a grid (FDTD)."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir.arrays import FloatArray, IntArray
from rir.errors import SceneError
from rir.walls import WallModel
from rir.walls.admittance import MOST_ABSORBED, real_admittance
from rooms.mesh.cut_cells import CutCells, cut_cells, whole_cells
from rooms.scene import Scene

__all__ = ["WaveGrid"]

_FREQUENCIES = 16  # admittances of walls are smooth within an octave
_ANGLES = (0.408, 0.707, 0.913)
"""Cosines of thirds of the sound that meets a wall from everywhere: roots of 1/6, 1/2
and 5/6."""
_MOST_CELLS = 4_000_000  # 32 MB an array

_CORNERS = np.array([[a, b, c] for a in (0, 1) for b in (0, 1) for c in (0, 1)])


@dataclass(frozen=True, eq=False)
class WaveGrid:
    """A scene cut into cells small enough for a highest frequency.

    Raises
    ------
    SceneError
        If the room would need more than 4 million cells.

    Notes
    -----
    Emitter and listeners are spread over eight cells with the same trilinear
    weights, so that the scheme is exactly symmetric in them.
    """

    scene: Scene
    """The room; any shape. Walls react locally, with one real admittance: the mean of
    the wall's model, or what absorbs as much diffuse sound as an octave says."""
    highest: float
    """Highest frequency of interest [Hz]."""
    cells_per_wave: float = 10.0
    """Cells per wavelength at that frequency. Waves along an axis are slower than those
    across all three, by 1.1 % where there are 10 and 3 % where there are 6; what they
    lose in the mean is made up for by `turns`."""
    octave: int = 0
    """Which octave of the scene says how much walls absorb."""
    lowest: float = 0.0
    """Lowest frequency of interest [Hz]."""

    def __post_init__(self) -> None:
        count = int(np.prod(self.shape, dtype=float))
        if count > _MOST_CELLS:
            raise SceneError(
                f"{self.scene.name} needs {count} cells up to {self.highest:.0f} Hz,"
                f" more than {_MOST_CELLS}; lower the crossover"
            )

    @cached_property
    def size(self) -> FloatArray:
        """Lengths of the bounding box [m], shape (3,)."""
        return np.asarray(self.scene.geometry.size, dtype=float)

    @cached_property
    def shape(self) -> IntArray:
        """Cells along each axis."""
        step = self.scene.speed_of_sound / (self.highest * self.cells_per_wave)
        return np.maximum(2, np.round(self.size / step)).astype(np.int64)

    @cached_property
    def spacing(self) -> FloatArray:
        """Size of a cell [m], shape (3,)."""
        return self.size / self.shape

    @cached_property
    def time_step(self) -> float:
        """Time step [s]: the longest that is stable, less a hair."""
        bound = np.sqrt(np.sum(1 / self.spacing**2)) * self.scene.speed_of_sound
        return 0.9999 / float(bound)

    @cached_property
    def sample_rate(self) -> float:
        """Steps per second [Hz]."""
        return 1 / self.time_step

    def responses(
        self, emitter: ArrayLike, listeners: ArrayLike, duration: float
    ) -> FloatArray:
        """Return responses at the grid's own rate, shape (listeners, steps).

        Parameters
        ----------
        emitter, listeners : array_like, shape (3,), (L, 3)
            Positions [m].
        duration : float
            Length [s].

        Returns
        -------
        ndarray
            Response to an impulse of unit area, times the time step: its sum over
            e^(-i w n dt) is the transfer function, 1/d in the free field.
        """
        source = self.pressure(np.asarray(emitter, float)[None])
        ears = self.pressure(np.asarray(listeners, float))
        return self.march(source[0][0], source[1][0], *ears, duration)

    def march(
        self,
        source: IntArray,
        share: FloatArray,
        ears: IntArray,
        weights: FloatArray,
        duration: float,
    ) -> FloatArray:
        """Return what weighted cells hear of weighted cells, shape (L, steps).

        Parameters
        ----------
        source, share : ndarray, shape (cells, 3), (cells,)
            Cells that are driven, and how strongly: one row of `pressure` or
            `slope`, or a sum of such.
        ears, weights : ndarray, shape (L, cells, 3), (L, cells)
            Cells that are heard, and their weights.
        duration : float
            Length [s].
        """
        from rooms.kernels.grid import march

        center, left, links = self._medium
        way = self.scene.speed_of_sound * self.time_step
        drive = share * 4 * np.pi * way**2 / float(np.prod(self.spacing))
        steps = int(np.ceil(duration * self.sample_rate))
        driven, heard = (self._numbers(cells) for cells in (source, ears))
        root = self._root
        heard = march(
            center, left, links, self._strides,
            driven, drive * root[driven], heard, weights * root[heard], steps,
        )  # fmt: skip
        # entry n holds the pressure at step n + 1
        return np.pad(heard, ((0, 0), (1, 0)))[:, :steps]

    def turns(self, frequencies: FloatArray) -> FloatArray:
        """Return the phase per time step at which the grid answers for frequencies.

        Waves on the grid are slower than sound, differently so by direction; here they
        are taken at the frequency at which they have the right length in the mean over
        all directions (L. Savioja, V. Välimäki, IEEE Trans. Speech Audio Process. 11,
        157 (2003), who warp frequencies of an interpolated mesh).
        """
        half = np.pi * frequencies * self.time_step
        slower = np.sqrt(1 - self._slowed(frequencies))
        return 2 * np.arcsin(np.minimum(half * slower, 1.0))

    def gain(self, frequencies: FloatArray) -> FloatArray:
        """Return what the grid's answers at `turns` are to be multiplied by.

        Slower waves lie closer in frequency, and so add up to more.
        """
        return 1 - 2 * self._slowed(frequencies)

    def _slowed(self, frequencies: FloatArray) -> FloatArray:
        """Return by what share differences along the axes miss the squared wavenumber.

        Along an axis they miss it by (k h)² / 12, and directions have a mean n⁴ of 1/5.
        """
        wave = 2 * np.pi * frequencies / self.scene.speed_of_sound
        return np.sum(self.spacing**2) * wave**2 / 60

    def pressure(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return cells (N, 8, 3) and weights (N, 8) of pressures at points (N, 3)."""
        return self._spread(points)

    def slope(self, points: FloatArray, axis: int) -> tuple[IntArray, FloatArray]:
        """Return cells (N, 16, 3) and weights [1/m] of the derivative along an axis.

        It is the difference of the pressures half a cell ahead and behind.
        """
        half = np.zeros(3)
        half[axis] = self.spacing[axis] / 2
        ahead, behind = self.pressure(points + half), self.pressure(points - half)
        weights = np.concatenate([ahead[1], -behind[1]], axis=1) / self.spacing[axis]
        return np.concatenate([ahead[0], behind[0]], axis=1), weights

    def blur(
        self,
        points: FloatArray,
        cells: IntArray,
        weights: FloatArray,
        frequencies: FloatArray,
        axis: int | None = None,
    ) -> FloatArray:
        """Return what weighted cells hear of a pressure, or a slope, of 1 at points.

        The mean over plane waves from everywhere, of which eight cells around a point
        hear the fainter, the shorter they are. Shape (N, frequencies).

        Parameters
        ----------
        points : ndarray, shape (N, 3)
            Places [m].
        cells, weights : ndarray, shape (N, n, 3), (N, n)
            As of `pressure`, or of `slope` along an axis.
        frequencies : ndarray, shape (frequencies,)
            Frequencies [Hz].
        axis : int, optional
            Axis of the slope.
        """
        corner = self.scene.geometry.center - self.size / 2
        way = (cells - 0.5) * self.spacing + corner - points[:, None]
        far = np.linalg.norm(way, axis=-1)
        wave = 2 * np.pi * frequencies / self.scene.speed_of_sound
        phase = far[..., None] * wave
        if axis is None:
            return np.einsum("nc,ncf->nf", weights, np.sinc(phase / np.pi))
        near = np.maximum(phase, 1e-3)
        bent = 3 * (np.sin(near) - near * np.cos(near)) / near**3
        return np.einsum("nc,ncf->nf", weights * way[..., axis], bent)

    @cached_property
    def _cells(self) -> CutCells:
        counts = tuple(map(int, self.shape))
        if self.scene.geometry.lattice:
            return whole_cells(counts)
        return cut_cells(self.scene.geometry.mesh, counts, _MOST_CELLS)

    @cached_property
    def _courant(self) -> FloatArray:
        return self.scene.speed_of_sound * self.time_step / self.spacing

    @cached_property
    def _air(self) -> FloatArray:
        """Share of air by which each cell answers, that of a cell without air 0.

        What little is left of a cell answers no faster than the time step is stable.
        """
        cells = self._cells
        least = self._flows(np.ones_like(cells.volume)) / 2
        return np.where(cells.volume > 0, np.maximum(cells.volume, least), 0.0)

    @cached_property
    def _root(self) -> FloatArray:
        """One over the root of each cell's share of air, in rows; 0 without air."""
        air = self._air.ravel()
        return np.where(air > 0, 1 / np.sqrt(np.where(air > 0, air, 1.0)), 0.0)

    @property
    def _strides(self) -> tuple[int, int]:
        _, ny, nz = self._air.shape
        return ny * nz, nz

    def _numbers(self, cells: IntArray) -> IntArray:
        far, wide = self._strides
        return cells @ np.array([far, wide, 1])

    @cached_property
    def _medium(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Weight of a cell's own pressure, of what walls leave, and links, in rows."""
        air = np.where(self._air > 0, self._air, 1.0)
        inside = self._air > 0
        center = np.where(inside, 2 - self._flows(np.ones_like(air)) / air, 0.0)
        left = np.where(inside, 1 / (1 + self._loss() / air), 0.0)
        links = []
        for axis, opening in enumerate(self._cells.openings):
            root = np.sqrt(air * np.roll(air, -1, axis))
            links.append((self._courant[axis] ** 2 * opening / root).ravel())
        return center.ravel(), left.ravel(), np.array(links)

    def _flows(self, values: FloatArray) -> FloatArray:
        """Return the sum over a cell's openings of their ratios times a value there."""
        total = np.zeros_like(values)
        for axis, opening in enumerate(self._cells.openings):
            part = self._courant[axis] ** 2 * opening * values
            total += part + np.roll(part, 1, axis)
        return total

    def _loss(self) -> FloatArray:
        """Return half of Courant number times admittance, over all walls of a cell."""
        admittance, courant = self._admittance(), np.repeat(self._courant, 2)
        loss = np.zeros_like(self._air)
        for wall, area in enumerate(self._cells.walls):
            loss += area * courant[wall] * admittance[wall] / 2
        return loss

    def _admittance(self) -> FloatArray:
        """Return the admittance of walls facing each way, shape (6,)."""
        scene = self.scene
        absorbed = scene.absorption[:, self.octave]
        real = real_admittance(np.minimum(absorbed, MOST_ABSORBED))
        for row, wall in scene.walls.items():
            real[row] = self._real_admittance(wall)
        return scene.geometry.facing() @ real

    def _real_admittance(self, wall: WallModel) -> float:
        """Return the conductance of a wall at the frequencies of the grid, a mean.

        Cells react locally and at once; of a wall that also stores sound only the loss
        is kept.
        """
        parts = (np.arange(_FREQUENCIES) + 0.5) / _FREQUENCIES
        f = self.lowest + (self.highest - self.lowest) * parts
        cosine = np.ones(1) if wall.locally_reacting else np.array(_ANGLES)
        return float(wall.admittance(f[:, None], cosine).real.mean())

    def _spread(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return the eight cells around each point and their shares.

        A share that would fall on a wall, or beyond, goes to the cells that the air
        around the point reaches.
        """
        corner = self.scene.geometry.center - self.size / 2
        place = (points - corner) / self.spacing - 0.5
        low = np.floor(place).astype(np.int64)
        part = place - low
        cells = low[:, None] + _CORNERS + 1
        cells = np.clip(cells, 0, np.array(self._air.shape) - 1)
        pieces = np.where(_CORNERS, part[:, None], 1 - part[:, None])
        shares = pieces.prod(axis=-1)
        air = self._air[tuple(np.moveaxis(cells, -1, 0))]
        cut = np.any(air < 1, axis=1)
        if np.any(cut):
            reached = shares[cut] * self._reached(cells[cut], part[cut])
            # at a wall there may be no air by the grid: take what is around
            none = ~np.any(reached > 0, axis=1, keepdims=True)
            around = shares[cut] * (air[cut] > 0)
            shares[cut] = np.where(none, around, reached)
        total = shares.sum(axis=1, keepdims=True)
        return cells, shares / np.where(total > 0, total, 1.0)

    def _reached(self, cells: IntArray, part: FloatArray) -> NDArray[np.bool_]:
        """Tell which of eight cells sound reaches from the one that holds a point.

        From face to face, in any order of the axes. Cells and answer of shape (N, 8).
        """
        where = tuple(np.moveaxis(cells, -1, 0))
        home = np.round(part).astype(np.int64) @ np.array([4, 2, 1])
        reached = np.zeros(cells.shape[:2], dtype=bool)
        reached[np.arange(len(cells)), home] = True
        reached &= self._air[where] > 0
        for _ in range(3):
            for axis, opening in enumerate(self._cells.openings):
                step = (4, 2, 1)[axis]
                first = np.nonzero(_CORNERS[:, axis] == 0)[0]
                lower = tuple(w[:, first] for w in where)
                either = reached[:, first] | reached[:, first + step]
                either &= opening[lower] > 0
                reached[:, first] |= either
                reached[:, first + step] |= either
        return reached
