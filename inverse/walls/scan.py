"""Find the walls of a room in its responses, with no prior.

A plane with signed distances a and b to the two ends of a row reflects along a
path of length sqrt(d^2 + 4 a b). Summing every response at that length, for many
planes, is a search in three dimensions: a Hough transform of sound.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from inverse.paths.polyhedron import tangents
from inverse.rows.direct import DirectSound, whitened
from inverse.rows.fitset import FitSet
from rir.arrays import FloatArray

__all__ = ["FoundPlane", "ScanSignals", "judge_planes", "scan_planes", "scan_signals"]

NORMALS = 4000  # 3.2 degrees apart, within reach of the first tilts of the refinement
STEP_M = 0.1  # moves an echo by 0.2 m at most, under half a wave of the first band
REACH_M = 9.0  # behind the nearest place: its echo nears the window's end
NEAREST_M = 0.02  # places may be off: the first plane stands so far behind all of them
KEPT = 48  # room for six walls and 18 images of second order, twice over
WINDOW_S = 0.06  # 20 m of path; later echoes overlap too densely to stand out
BANDS_HZ = ((80.0, 700.0), (80.0, 1500.0), (80.0, 3500.0))
"""Wide peaks are found first and then sharpened. Loudspeakers are weak below; above,
places a few centimetres off no longer add in phase."""
SHIFTS_S = np.concatenate([-np.linspace(3e-3, 6e-4, 9), np.linspace(6e-4, 3e-3, 9)])
"""Wrong delays that tell chance: past a pulse's width, near enough for like sound."""
GROUPS = 8  # of emitters: as many votes, each with enough rows for a score
SURE_Z = 4.0  # median score of a wall over the groups (decision 0055)


@dataclass(frozen=True, eq=False)
class FoundPlane:
    """Hold a plane the responses speak for."""

    normal: FloatArray
    """Unit vector into the room, shape (3,)."""
    offset: float
    """Metres; a point p is inside when normal . p > offset."""
    z: float
    """Median over emitter groups of the score in standard deviations of the same rows
    read at wrong delays."""
    strength: float
    """Mean reflected level, about the wall's reflection factor."""
    support: float
    """Part of the groups in front of the plane that speak for it."""
    pooled: float = 0.0
    """Score of all groups together, in standard deviations."""
    speaking: int = 0
    """Number of groups that speak for it."""
    loudest: float = 0.0
    """Score of the group that speaks for it most, where it was asked."""

    @property
    def row(self) -> FloatArray:
        """Normal and offset, shape (4,)."""
        return np.append(self.normal, self.offset)


@dataclass(frozen=True, eq=False)
class ScanSignals:
    """Hold band-limited rows ready for summing along paths."""

    signals: NDArray[np.float32]
    emitters: FloatArray
    listeners: FloatArray
    groups: NDArray[np.int64]
    samples_a_metre: float

    @property
    def n_groups(self) -> int:
        """Number of emitter groups."""
        return int(self.groups.max()) + 1

    @property
    def scaled(self) -> tuple[FloatArray, FloatArray]:
        """Both ends in samples of path."""
        return (
            self.emitters * self.samples_a_metre,
            self.listeners * self.samples_a_metre,
        )

    def sums(
        self, planes: FloatArray, shifts: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Sum along planes (K, 4) at path shifts in metres; see `sum_planes`."""
        from inverse.walls.scan_kernel import sum_planes

        planes = np.ascontiguousarray(planes, dtype=np.float64).copy()
        planes[:, 3] *= self.samples_a_metre
        first, second = self.scaled
        moves = np.asarray(shifts, dtype=np.float64) * self.samples_a_metre
        sums = np.empty((len(planes), self.n_groups, len(moves)))
        counts = np.empty((len(planes), self.n_groups))
        sum_planes(
            self.signals, first, second, self.groups, planes, moves, sums, counts
        )
        return sums, counts


def scan_signals(
    rows: FitSet, direct: DirectSound, bands: tuple[tuple[float, float], ...] = BANDS_HZ
) -> list[ScanSignals]:
    """Return the rows in several bands, whitened, times their path length."""
    rate = rows.sample_rate
    size = int(2 ** np.ceil(np.log2(rows.n_samples + 0.01 * rate)))
    spectra = whitened(rows, direct, size)
    kept = min(rows.n_samples, round(WINDOW_S * rate))
    groups = _groups(rows)
    made = []
    for low, high in bands:
        factor = _stretch(rate, high)
        shape = _band_shape(size, rate, low, min(high, 0.45 * rate))
        signal = np.fft.irfft(spectra * shape, size * factor)[:, : kept * factor]
        metres = np.arange(kept * factor) * rows.speed_of_sound / (rate * factor)
        # 1 for a pulse of a wall that reflects all
        signal = signal * metres / (np.fft.irfft(shape, size * factor)[0] or 1.0)
        signal /= _pulse_level(direct)
        bound = 4 * np.median(np.abs(signal)) / 0.6745 + 1e-300
        limited = np.clip(signal, -bound, bound).astype(np.float32)
        limited[:, -2:] = 0.0
        made.append(
            ScanSignals(
                limited,
                rows.emitters.positions,
                rows.listeners.positions,
                groups,
                rate * factor / rows.speed_of_sound,
            )
        )
    return made


def _pulse_level(direct: DirectSound) -> float:
    size = 4 * len(direct.pulse)
    spectrum = np.abs(np.fft.rfft(direct.pulse, size))
    return float(np.median(spectrum)) or 1.0


def _stretch(rate: float, high: float) -> int:
    return max(1, int(np.ceil(6 * high / rate)))


def _band_shape(size: int, rate: float, low: float, high: float) -> FloatArray:
    hertz = np.arange(size // 2 + 1) * rate / size
    rise = np.clip(hertz / low - 0.5, 0, 1)
    fall = np.clip((1.25 * high - hertz) / (0.5 * high), 0, 1)
    return (np.sin(0.5 * np.pi * rise) * np.sin(0.5 * np.pi * fall)) ** 2


def _groups(rows: FitSet) -> NDArray[np.int64]:
    """Return up to a few groups of neighbouring emitters, numbered, by row."""
    count = rows.n_places
    if count <= GROUPS:
        return rows.places
    from scipy.cluster.vq import kmeans2

    first = np.unique(rows.places, return_index=True)[1]
    places = rows.emitters.positions[first]
    rng = np.random.default_rng(0)
    _, label = kmeans2(places, GROUPS, minit="++", rng=rng)
    _, label = np.unique(label, return_inverse=True)
    return label.reshape(-1)[rows.places].astype(np.int64)


@lru_cache(maxsize=2)
def even_normals(count: int = NORMALS) -> FloatArray:
    """Return directions spread evenly over the sphere, shape (count, 3)."""
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    turn = np.pi * (1 + 5**0.5) * k
    flat = np.sqrt(1 - z * z)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)


def scan_planes(signals: list[ScanSignals]) -> list[FoundPlane]:
    """Return the planes all poses stand in front of, the strongest first.

    Phantoms (images of higher order) are still among them; see
    `inverse.rules`.
    """
    coarse = _coarse(signals[0])
    refined = _refined(signals, coarse)
    judged = judge_planes(signals[-1], refined)
    return sorted(_distinct(judged, signals[-1]), key=lambda plane: -plane.z)


def _coarse(signals: ScanSignals) -> FloatArray:
    from inverse.walls.scan_kernel import scan_grid

    normals = even_normals()
    first, second = signals.scaled
    ends = np.concatenate([first, second])
    unit = signals.samples_a_metre
    nearest = (ends @ normals.T).min(axis=0) - NEAREST_M * unit
    scores = np.empty((len(normals), int(REACH_M / STEP_M)))
    weights = 1 / np.sqrt(_variances(signals))
    scan_grid(
        signals.signals,
        first,
        second,
        signals.groups,
        weights,
        normals,
        nearest,
        STEP_M * unit,
        scores,
    )
    peak = np.full(scores.shape, True)
    peak[:, 1:] &= scores[:, 1:] >= scores[:, :-1]
    peak[:, :-1] &= scores[:, :-1] > scores[:, 1:]
    which, depth = np.nonzero(peak & (scores > 2.0))
    order = np.argsort(-scores[which, depth])[: 40 * KEPT]
    which, depth = which[order], depth[order]
    offsets = nearest[which] / unit - STEP_M * depth
    planes = np.column_stack([normals[which], offsets])
    return _thinned(planes, ends.mean(axis=0) / unit, 0.12, 0.25)


def _variances(signals: ScanSignals) -> FloatArray:
    power = np.mean(signals.signals.astype(np.float64) ** 2, axis=1)
    total = np.bincount(signals.groups, power, minlength=signals.n_groups)
    return np.maximum(total, 1e-300)


def _thinned(
    planes: FloatArray, center: FloatArray, angle: float, gap: float
) -> FloatArray:
    """Keep planes, best first, that differ from all better ones."""
    away = planes[:, :3] @ center - planes[:, 3]
    remaining = np.arange(len(planes))
    kept: list[int] = []
    while len(remaining) and len(kept) < KEPT:
        best = int(remaining[0])
        kept.append(best)
        turned = planes[remaining, :3] @ planes[best, :3] < np.cos(angle)
        remaining = remaining[turned | (np.abs(away[remaining] - away[best]) > gap)]
    return planes[kept]


def _alike(
    one: FloatArray, other: FloatArray, center: FloatArray, angle: float, gap: float
) -> bool:
    away = float(one[:3] @ center - one[3]) - float(other[:3] @ center - other[3])
    return bool(one[:3] @ other[:3] > np.cos(angle) and abs(away) < gap)


def _refined(signals: list[ScanSignals], planes: FloatArray) -> FloatArray:
    ends = np.concatenate([signals[0].emitters, signals[0].listeners])
    center = ends.mean(axis=0)
    spread = max(float(np.sqrt(((ends - center) ** 2).sum(axis=1).mean())), 0.5)
    move = 0.06
    for one in signals:
        for _ in range(3):
            planes = np.array(
                [_better(one, plane, center, spread, move) for plane in planes]
            ).reshape(-1, 4)
            move *= 0.5
        move *= 1.6
    return planes


# two steps to both sides, of both tilts and the offset
_GRID = np.stack(np.meshgrid(*[np.arange(-2, 3)] * 3, indexing="ij"), -1).reshape(-1, 3)


def _better(
    signals: ScanSignals,
    plane: FloatArray,
    center: FloatArray,
    spread: float,
    move: float,
) -> FloatArray:
    """Return the best plane of a small grid of tilts and offsets."""
    tried = tilted(plane, center, _GRID * (move / np.array([spread, spread, 1.0])))
    sums, _ = signals.sums(tried, np.zeros(1))
    return tried[int(np.argmax(_balanced(sums[..., 0] / np.sqrt(_variances(signals)))))]


def tilted(plane: FloatArray, center: FloatArray, moves: FloatArray) -> FloatArray:
    """Tilt a plane about a point and move it along its normal.

    Parameters
    ----------
    plane : ndarray, shape (4,)
        Normal and offset.
    center : ndarray, shape (3,)
        Point whose distance to the plane a tilt keeps.
    moves : ndarray, shape (K, 3)
        Two tilts in radians and a shift in metres.
    """
    normal = plane[:3]
    first, second = tangents(normal)
    turned = normal + moves[:, :1] * first + moves[:, 1:2] * second
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    away = normal @ center - plane[3] + moves[:, 2]
    return np.column_stack([turned, turned @ center - away])


def _balanced(values: FloatArray) -> FloatArray:
    """Return the emitter-balanced score of z-scores (K, groups)."""
    groups = values.shape[1]
    if groups == 1:
        return values[:, 0]
    return (values.sum(axis=1) - values.max(axis=1)) / np.sqrt(groups - 1)


def judge_planes(signals: ScanSignals, planes: FloatArray) -> list[FoundPlane]:
    """Compare every plane with the same rows read at wrong delays."""
    if len(planes) == 0:
        return []
    shifts = np.concatenate([[0.0], SHIFTS_S * 343.0])
    sums, counts = signals.sums(planes, shifts)
    null = sums[..., 1:]
    spread = np.sqrt(np.mean((null - null.mean(axis=2, keepdims=True)) ** 2, axis=2))
    z = (sums[..., 0] - null.mean(axis=2)) / np.maximum(spread, 1e-12)
    found = []
    for k, plane in enumerate(planes):
        enough = counts[k] >= 3
        if not enough.any():
            enough = counts[k] > 0
        if not enough.any():
            continue
        values = z[k, enough]
        strength = float(sums[k, enough, 0].sum() / counts[k, enough].sum())
        found.append(
            FoundPlane(
                plane[:3].copy(),
                float(plane[3]),
                float(np.median(values)),
                strength,
                float(np.mean(values > 3)),
                float(values.sum() / np.sqrt(len(values))),
            )
        )
    return found


def _distinct(planes: list[FoundPlane], signals: ScanSignals) -> list[FoundPlane]:
    center = np.concatenate([signals.emitters, signals.listeners]).mean(axis=0)
    kept: list[FoundPlane] = []
    for plane in sorted(planes, key=lambda one: -one.strength):
        if not any(_alike(plane.row, k.row, center, 0.1, 0.12) for k in kept):
            kept.append(plane)
    return kept
