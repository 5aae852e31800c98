"""Low frequencies by the wave equation on a grid (FDTD)."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike

from rir.arrays import FloatArray, IntArray
from rir.errors import SceneError
from rir.walls import WallModel
from rir.walls.admittance import MOST_ABSORBED, real_admittance
from rooms.mesh import MeshGeometry
from rooms.mesh.columns import filled_cells
from rooms.scene import Scene

__all__ = ["WaveGrid"]

_FREQUENCIES = 16  # admittances of walls are smooth below a crossover
_ANGLES = (0.408, 0.707, 0.913)
"""Cosines of thirds of the sound that meets a wall from everywhere: roots of 1/6, 1/2
and 5/6."""
_MOST_CELLS = 4_000_000  # ten times what the planner asks for: 32 MB an array


@lru_cache(maxsize=8)
def _air_cells(mesh: MeshGeometry, counts: tuple[int, int, int]) -> FloatArray:
    """Return 1 for cells in the air, with a frame of zeros; once for all emitters."""
    shape = np.array(counts)
    size = np.asarray(mesh.size, dtype=float)
    # the triangles' corners are stated relative to the middle of the mesh
    low, spacing = -size / 2, size / shape
    if mesh.watertight:
        return np.pad(filled_cells(mesh.corners, low, spacing, shape), 1)
    from rooms.kernels.grid import winding_numbers

    axes = [np.arange(n) + 0.5 for n in counts]
    cells = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1) * spacing + low
    turns = np.abs(winding_numbers(cells.reshape(-1, 3), mesh.corners))
    return np.pad((turns > 0.5).reshape(counts).astype(float), 1)


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
    the wall's model, or what absorbs of diffuse sound what the lowest octave says."""
    highest: float
    """Highest frequency of interest [Hz]."""
    cells_per_wave: float = 10.0
    """Cells per wavelength at that frequency; 10 keep the error of the speed of sound
    near 1 %."""

    def __post_init__(self) -> None:
        count = int(np.prod(self.shape, dtype=float))
        if count > _MOST_CELLS:
            raise SceneError(
                f"{self.scene.name} needs {count} cells up to {self.highest:.0f} Hz,"
                f" more than {_MOST_CELLS}; lower the crossover"
            )

    @property
    def size(self) -> FloatArray:
        """Lengths of the bounding box [m], shape (3,)."""
        return np.asarray(self.scene.geometry.size, dtype=float)

    @property
    def shape(self) -> IntArray:
        """Cells along each axis."""
        step = self.scene.speed_of_sound / (self.highest * self.cells_per_wave)
        return np.maximum(2, np.round(self.size / step)).astype(np.int64)

    @property
    def spacing(self) -> FloatArray:
        """Size of a cell [m], shape (3,)."""
        return self.size / self.shape

    @property
    def time_step(self) -> float:
        """Time step [s]: the longest that is stable, less a hair."""
        bound = np.sqrt(np.sum(1 / self.spacing**2)) * self.scene.speed_of_sound
        return 0.9999 / float(bound)

    @property
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

        center, left, ratios = self._medium
        way = self.scene.speed_of_sound * self.time_step
        drive = share * 4 * np.pi * way**2 / float(np.prod(self.spacing))
        steps = int(np.ceil(duration * self.sample_rate))
        heard = march(center, ratios, left, source, drive, ears, weights, steps)
        # entry n holds the pressure at step n + 1
        return np.pad(heard, ((0, 0), (1, 0)))[:, :steps]

    def pressure(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return cells (N, 8, 3) and weights (N, 8) of pressures at points (N, 3)."""
        return self._spread(points, self._air)

    def slope(self, points: FloatArray, axis: int) -> tuple[IntArray, FloatArray]:
        """Return cells (N, 16, 3) and weights [1/m] of the derivative along an axis.

        It is the difference of the pressures half a cell ahead and behind.
        """
        half = np.zeros(3)
        half[axis] = self.spacing[axis] / 2
        ahead, behind = self.pressure(points + half), self.pressure(points - half)
        weights = np.concatenate([ahead[1], -behind[1]], axis=1) / self.spacing[axis]
        return np.concatenate([ahead[0], behind[0]], axis=1), weights

    @cached_property
    def _air(self) -> FloatArray:
        return self._inside()

    @cached_property
    def _medium(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Weight of a cell's own pressure, of what walls leave, and axis ratios."""
        inside = self._air
        courant = self.scene.speed_of_sound * self.time_step / self.spacing
        left = np.where(inside > 0, 1 / (1 + self._loss(inside, courant)), 0.0)
        return 2 - self._neighbours(inside, courant**2), left, courant**2

    def _inside(self) -> FloatArray:
        """Return 1 for cells whose middle is in the air, with a frame of zeros."""
        if self.scene.geometry.lattice:
            return np.pad(np.ones(tuple(self.shape)), 1)
        counts = tuple(map(int, self.shape))
        return _air_cells(self.scene.geometry.mesh, counts)

    def _neighbours(self, inside: FloatArray, ratios: FloatArray) -> FloatArray:
        """Return the sum of the ratios over the neighbours in the air."""
        total = np.zeros_like(inside)
        for axis in range(3):
            for shift in (1, -1):
                total += ratios[axis] * np.roll(inside, shift, axis=axis)
        return total

    def _loss(self, inside: FloatArray, courant: FloatArray) -> FloatArray:
        """Return half of Courant number times admittance, over all walls of a cell."""
        admittance = self._admittance()
        loss = np.zeros_like(inside)
        for axis in range(3):
            for side, shift in ((0, 1), (1, -1)):
                neighbour = np.roll(inside, shift, axis=axis)
                wall = inside * (1 - neighbour)
                loss += wall * courant[axis] * admittance[2 * axis + side] / 2
        return loss

    def _admittance(self) -> FloatArray:
        """Return the admittance of walls facing each way, shape (6,)."""
        scene = self.scene
        real = real_admittance(np.minimum(scene.absorption[:, 0], MOST_ABSORBED))
        for row, wall in scene.walls.items():
            real[row] = self._real_admittance(wall)
        return scene.geometry.facing() @ real

    def _real_admittance(self, wall: WallModel) -> float:
        """Return the conductance of a wall at the frequencies of the grid, a mean.

        Cells react locally and at once; of a wall that also stores sound only the loss
        is kept.
        """
        f = self.highest * (np.arange(_FREQUENCIES) + 0.5) / _FREQUENCIES
        cosine = np.ones(1) if wall.locally_reacting else np.array(_ANGLES)
        return float(wall.admittance(f[:, None], cosine).real.mean())

    def _spread(
        self, points: FloatArray, inside: FloatArray
    ) -> tuple[IntArray, FloatArray]:
        """Return the eight cells around each point and their shares.

        A share that would fall on a wall goes to the cells in the air.
        """
        corner = self.scene.geometry.center - self.size / 2
        place = (points - corner) / self.spacing - 0.5
        low = np.floor(place).astype(np.int64)
        part = place - low
        corners = np.array([[a, b, c] for a in (0, 1) for b in (0, 1) for c in (0, 1)])
        cells = low[:, None] + corners + 1
        cells = np.clip(cells, 0, np.array(inside.shape) - 1)
        pieces = np.where(corners, part[:, None], 1 - part[:, None])
        shares = pieces.prod(axis=-1) * inside[tuple(np.moveaxis(cells, -1, 0))]
        total = shares.sum(axis=1, keepdims=True)
        return cells, shares / np.where(total > 0, total, 1.0)
