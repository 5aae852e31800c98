"""Find small objects one after the other, while they explain rows kept out better."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from inverse.bands.band_fit import KEPT_OUT, LEAST_ROWS, BandData
from inverse.bands.banded_room import BandedRoom
from inverse.bands.scatterers import Scatterers
from inverse.objects.scatter_scan import ResidualSignals, residual_signals
from rir.arrays import ComplexArray, FloatArray

__all__ = ["find_scatterers", "with_scatterers"]

GRID_M = 0.11  # moves a path by 0.2 m, under a wave of 1.4 kHz (decision 0064)
MARGIN_M = 0.15  # objects nearer to a wall are heard as the wall's
APART_M, SAME_M = 0.35, 0.1  # peaks of one object; ways up to one place
SCAN_HZ = (350.0, 1400.0)  # lower, peaks are as wide as rooms; higher, poses blur them
MOST_POINTS = 120000  # of the grid, which is coarser in large rooms
SCAN_ROWS = 24  # enough for peaks; each row costs 49 paths a point
MOST, ROUNDS, PATIENCE = 24, 4, 4  # objects, scans, and peaks in turn that prove wrong
CLEAR, ANEW = 3.6, 1.3
"""Agreement over its median that is looked at, and that is scanned again."""
STEPS = ((350.0, 1400.0, 0.06), (700.0, 2800.0, 0.02), (1400.0, 5600.0, 0.008))
"""Bands and steps, metres, of the climb: 1/4 to 1/8 of the shortest wave."""
SURE = 12.0
"""Agreement of the judging rows, in standard deviations of chance: true points had
23 to 131, false ones below 9 (decision 0064)."""
LOWEST_HZ, RIDGE = 150.0, 1e-3  # small objects send little below; parts neighbours


@dataclass(eq=False)
class PointSearch:
    """Hold points with what each of them, alone and of gain 1, sends to the rows."""

    data: BandData
    banded: BandedRoom
    residual: ComplexArray
    weights: FloatArray
    rest: ComplexArray
    points: list[FloatArray] = field(default_factory=list)
    columns: list[ComplexArray] = field(default_factory=list)
    _signals: dict[tuple[float, float], ResidualSignals] = field(default_factory=dict)

    @property
    def judging(self) -> NDArray[np.bool_]:
        """Rows that only judge."""
        return np.arange(len(self.residual)) % KEPT_OUT == KEPT_OUT - 1

    def signals(self, low_hz: float, high_hz: float) -> ResidualSignals:
        """Return what the fitted rows have left between two frequencies."""
        if (low_hz, high_hz) not in self._signals:
            some = np.flatnonzero(~self.judging)
            fitted = _some(self.data, some)
            self._signals[low_hz, high_hz] = residual_signals(
                fitted, self.banded, self.rest[some], low_hz, high_hz
            )
        return self._signals[low_hz, high_hz]

    def add(self, point: FloatArray, column: ComplexArray) -> None:
        """Take a point in and fit the gains of all anew."""
        self.points.append(point)
        self.columns.append(column)
        gains = _solved(self, self.columns, self.residual, ~self.judging)
        self.rest = self.residual.copy()
        for gain, sent in zip(gains.T, self.columns, strict=True):
            self.rest -= np.repeat(gain, self.banded.grid.lengths) * sent
        self._signals.clear()


def with_scatterers(data: BandData, banded: BandedRoom) -> BandedRoom:
    """Return the room with the points found in it, if any."""
    if len(data.targets) < LEAST_ROWS or not banded.room.box.found.all():
        return banded
    found = find_scatterers(data, banded)
    return replace(banded, scatterers=found) if len(found) else banded


def find_scatterers(data: BandData, banded: BandedRoom) -> Scatterers:
    """Return the points that rows not fitted agree to.

    Parameters
    ----------
    data : BandData
        Fitted rows, their places corrected.
    banded : BandedRoom
        The room whose images predict them.
    """
    kernels = banded.kernels(data.weight)
    images = banded.envelopes(data.emitters, data.listeners, kernels)
    residual = data.targets - images
    found = PointSearch(data, banded, residual, _weights(residual, banded), residual)
    spacing, middle = _spacing(banded), 0.0
    grid = _grid(banded, spacing)
    low, high = np.array(SCAN_HZ) * GRID_M / spacing
    for turn in range(ROUNDS):
        score = found.signals(low, high).rows(SCAN_ROWS).agreement(grid)
        if turn == 0:
            middle = float(np.median(score))
        before = len(found.points)
        _taken(found, _peaks(grid, score, CLEAR * middle, found.points))
        grid = grid[score > ANEW * middle] if turn == 0 else grid
        if len(found.points) == before or len(found.points) >= MOST:
            break
    if not found.points:
        return Scatterers.none(banded.grid.bands)
    whole = np.ones(len(residual), dtype=bool)
    gains = _solved(found, found.columns, residual, whole)
    return Scatterers(np.array(found.points).reshape(-1, 3), gains)


def _taken(found: PointSearch, peaks: list[FloatArray]) -> None:
    """Take in points one after the other until some fail in a row."""
    failed = 0
    for peak in peaks:
        failed = 0 if _tried(found, peak) else failed + 1
        if failed == PATIENCE or len(found.points) >= MOST:
            return


def _weights(residual: ComplexArray, banded: BandedRoom) -> FloatArray:
    """Return weights of squared errors, shape (rows, total): noise gets 1."""
    grid = banded.grid
    energy = np.add.reduceat(np.abs(residual) ** 2, grid.starts, axis=1)
    rows = energy / np.maximum(energy.mean(axis=0), 1e-300)
    share = np.median(rows, axis=1)
    bands = (energy / share[:, None]).mean(axis=0) / grid.lengths
    heard = grid.centers > LOWEST_HZ
    weights = heard / (share[:, None] * np.maximum(bands, 1e-300))
    return np.repeat(weights, grid.lengths, axis=1)


def _spacing(banded: BandedRoom) -> float:
    """Return the step of the grid; large rooms are scanned coarser and lower."""
    volume = float(np.prod(banded.room.box.high - banded.room.box.low))
    return float(max(GRID_M, (volume / MOST_POINTS) ** (1 / 3)))


def _grid(banded: BandedRoom, spacing: float) -> FloatArray:
    """Return places inside the walls, in the room."""
    box = banded.room.box
    axes = []
    for low, high in zip(box.low, box.high, strict=True):
        count = max(int((high - low - 2 * MARGIN_M) / spacing), 1)
        axes.append(np.linspace(low + MARGIN_M, high - MARGIN_M, count + 1))
    inside = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return inside @ box.axes + box.origin


def _peaks(
    grid: FloatArray, score: FloatArray, least: float, taken: list[FloatArray]
) -> list[FloatArray]:
    score = score.copy()
    for point in taken:
        score[_gap(grid, point) < APART_M] = 0
    peaks = []
    while len(peaks) < MOST and score.max(initial=0.0) > least:
        peak = grid[int(np.argmax(score))]
        peaks.append(peak)
        score[_gap(grid, peak) < APART_M] = 0
    return peaks


def _gap(points: FloatArray, point: FloatArray) -> FloatArray:
    return np.linalg.norm(points - point, axis=1)


def _some(data: BandData, index: NDArray) -> BandData:
    return replace(
        data,
        emitters=data.emitters[index],
        listeners=data.listeners[index],
        targets=data.targets[index],
        power=data.power[index],
    )


def _tried(found: PointSearch, place: FloatArray) -> bool:
    """Take in a point at a place, unless the rows kept out do not gain."""
    point = _climbed(found, place)
    if any(np.linalg.norm(point - other) < SAME_M for other in found.points):
        return False
    column = _column(found.data, found.banded, point)
    gains = _solved(found, [column], found.rest, ~found.judging)
    judge = found.judging
    sent_sound = np.repeat(gains[:, 0], found.banded.grid.lengths) * column[judge]
    weight, rest = found.weights[judge], found.rest[judge]
    agree = float((weight * (sent_sound.conj() * rest).real).sum())
    power = float((weight * np.abs(sent_sound) ** 2).sum())
    sure = agree / np.sqrt(max(power, 1e-300))
    if sure < SURE or 2 * agree < power:
        return False
    found.add(point, column)
    return True


def _climbed(found: PointSearch, point: FloatArray) -> FloatArray:
    """Return the place nearby where agreement is greatest, coarse to fine."""
    cube = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3, indexing="ij"), -1).reshape(-1, 3)
    coarser = _spacing(found.banded) / GRID_M
    low, high, step = STEPS[0]
    first = (low / coarser, high / coarser, step * coarser)
    for low, high, step in (first, *STEPS[coarser == 1 :]):
        signals = found.signals(low, high)
        wide = step
        for _ in range(8):
            around = point + wide * cube
            best = around[int(np.argmax(signals.agreement(around)))]
            if np.array_equal(best, point):
                if wide < 0.6 * step:
                    break
                wide /= 2
            point = best
    return point


def _column(data: BandData, banded: BandedRoom, point: FloatArray) -> ComplexArray:
    grid = banded.grid
    out = np.zeros((len(data.targets), grid.total), dtype=np.complex128)
    one = Scatterers(point[None], np.ones((grid.bands, 1), dtype=np.complex128))
    kernels = banded.kernels(data.weight)
    chosen = grid.centers > LOWEST_HZ
    taken = banded.loop_input(data.emitters, data.listeners, kernels)
    one.add(taken, banded.room.box, chosen, out)
    return out


def _solved(
    found: PointSearch,
    columns: list[ComplexArray],
    residual: ComplexArray,
    rows: NDArray[np.bool_],
) -> ComplexArray:
    """Return gains of points by least squares, shape (bands, points)."""
    grid = found.banded.grid
    gains = np.zeros((grid.bands, len(columns)), dtype=np.complex128)
    for band in np.flatnonzero(grid.centers > LOWEST_HZ).tolist():
        first = int(grid.starts[band])
        here = slice(first, first + int(grid.lengths[band]))
        root = np.sqrt(found.weights[rows, here])
        matrix = np.stack([(root * one[rows, here]).ravel() for one in columns])
        square = matrix.conj() @ matrix.T
        right = matrix.conj() @ (root * residual[rows, here]).ravel()
        size = np.real(np.trace(square)) / len(square)
        square[np.diag_indices_from(square)] += RIDGE * size
        gains[band] = np.linalg.solve(square, right)
    return gains
