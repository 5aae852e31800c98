"""Responses and poses made ready for training: one rate, one length, one scale."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import numpy as np

from fields.frame import SceneFrame
from fields.shape import known_shape
from fields.surfaces import sample_surface
from rir import Dataset, Poses
from rir.errors import DatasetError, SignalError
from rir.physics import speed_of_sound
from rir.recording_blocks import RecordingBlocks, recording_blocks

__all__ = ["FieldData", "check_dataset", "prepare"]

IN_MEMORY_BYTES = 1_500_000_000
CHUNK_ROWS = 256
SURFACE_POINTS = 1024
NEAREST_DISTANCE_M = 0.1
LOUDEST = 1e6
HIGHEST_RATE_HZ = 1e6


@dataclass(frozen=True, eq=False)
class FieldData:
    """Hold what a field learns from.

    Parameters
    ----------
    responses : numpy.ndarray
        Shape (rows, n_samples), float32, divided by ``frame.scale``; a memory
        map when the set is larger than memory.
    emitters, listeners : Poses
        One pose a row.
    frame : SceneFrame
        Box, time axis and scale.
    recording : RecordingBlocks, optional
        When the rows were recorded and how warm it was; None where unknown.
    """

    responses: np.ndarray
    emitters: Poses
    listeners: Poses
    frame: SceneFrame
    recording: RecordingBlocks | None = None

    def __len__(self) -> int:
        return len(self.responses)

    def rows(self, index: np.ndarray) -> "FieldData":
        """Return some rows, in the order of ``index``."""
        return replace(
            self,
            responses=self.responses[index],
            emitters=self.emitters[index],
            listeners=self.listeners[index],
            recording=None if self.recording is None else self.recording.rows(index),
        )

    @property
    def endpoints(self) -> np.ndarray:
        """Both ends of every row, shape (rows, 6), metres."""
        return np.hstack([self.emitters.positions, self.listeners.positions])


def prepare(
    dataset: Dataset,
    *,
    sample_rate: float | None = None,
    duration: float | None = None,
    train_rows: np.ndarray | None = None,
    seed: int = 0,
    store: Path | None = None,
) -> FieldData:
    """Read a data set, resample, crop and scale it.

    Parameters
    ----------
    dataset : Dataset
        Any number of sessions, in memory or on disk; read in chunks.
    sample_rate : float, optional
        Rate to train at, hertz; polyphase resampling with its low-pass, never
        a stride. The data's own by default.
    duration : float, optional
        Length to keep from the emission on, seconds. The data's own by default.
    train_rows : numpy.ndarray, optional
        Rows that may set the scale; all by default.
    seed : int
        Draws the points on the surfaces.
    store : Path, optional
        Folder for a memory map, used when the result exceeds 1.5 GB.

    Raises
    ------
    DatasetError
        If it is no data set, or an empty one.
    SignalError
        If a response holds NaN or infinity, or a pose does, or the rate or the
        duration is no sensible number.
    """
    check_dataset(dataset)
    _check_number("sample rate", sample_rate, "Hz", HIGHEST_RATE_HZ)
    _check_number("duration", duration, "s", math.inf)
    rate = float(sample_rate or dataset.sample_rate)
    factor = Fraction(rate / dataset.sample_rate).limit_denominator(4096)
    n_samples = _kept_samples(dataset, rate, factor, duration)
    responses = _storage(len(dataset), n_samples, store)
    for start, block in _chunks(dataset):
        resampled = _resampled(_finite(block, start), factor)[:, :n_samples]
        responses[start : start + len(block)] = resampled
    rows = np.arange(len(dataset)) if train_rows is None else train_rows
    scale = _scale(responses, dataset, rows)
    for start in range(0, len(responses), CHUNK_ROWS):
        responses[start : start + CHUNK_ROWS] /= scale
    frame = _frame(dataset, rate, n_samples, scale, seed)
    return FieldData(
        responses.astype(np.float32, copy=False),
        dataset.emitters,
        dataset.listeners,
        frame,
        recording_blocks(dataset),
    )


def check_dataset(dataset: Dataset) -> None:
    """Refuse what is no data set, and one without responses.

    Raises
    ------
    DatasetError
        If there is nothing to learn from.
    """
    if not isinstance(dataset, Dataset):
        raise DatasetError(
            f"a field learns from a Dataset, not from {type(dataset).__name__}; "
            "make one with Dataset.open(path) or Dataset.from_arrays(responses, "
            "emitters, listeners, sample_rate=...)"
        )
    if len(dataset) == 0:
        raise DatasetError("the data set holds no responses: nothing to learn from")


def _check_number(what: str, asked: float | None, unit: str, most: float) -> None:
    if asked is None:
        return
    if isinstance(asked, bool) or not isinstance(asked, int | float | np.number):
        raise SignalError(f"{what} {asked!r} is not a number of {unit}")
    if not 0 <= asked <= most or asked == math.inf:
        raise SignalError(
            f"{what} {asked:g} {unit} is negative or beyond reason; "
            "leave it out to keep the data's own"
        )


def _kept_samples(
    dataset: Dataset, rate: float, factor: Fraction, duration: float | None
) -> int:
    available = -(-dataset.n_samples * factor.numerator // factor.denominator)
    if duration is None:
        return available
    return max(1, min(available, round(duration * rate)))


def _storage(rows: int, n_samples: int, store: Path | None) -> np.ndarray:
    # Stored responses of 1e-12 or 1e6 must survive until they are scaled.
    if rows * n_samples * 4 <= IN_MEMORY_BYTES or store is None:
        return np.empty((rows, n_samples), dtype=np.float32)
    store.mkdir(parents=True, exist_ok=True)
    return np.lib.format.open_memmap(
        store / "responses.npy", mode="w+", dtype=np.float32, shape=(rows, n_samples)
    )


def _chunks(dataset: Dataset) -> Iterator[tuple[int, np.ndarray]]:
    for start in range(0, len(dataset), CHUNK_ROWS):
        stop = min(start + CHUNK_ROWS, len(dataset))
        yield start, np.asarray(dataset.responses[start:stop], dtype=np.float64)


def _finite(block: np.ndarray, start: int) -> np.ndarray:
    broken = np.flatnonzero(~np.isfinite(block).all(axis=1))
    if len(broken):
        named = ", ".join(str(start + row) for row in broken[:5])
        raise SignalError(
            f"{len(broken)} of rows {start}-{start + len(block) - 1} hold NaN or "
            f"infinity (first: {named}); leave them out with dataset.subset"
        )
    return block


def _resampled(block: np.ndarray, factor: Fraction) -> np.ndarray:
    if factor == 1:
        return block
    from scipy.signal import resample_poly

    # A response is a density in time: keep its transfer function's level.
    up, down = factor.numerator, factor.denominator
    return resample_poly(block, up, down, axis=-1) * (down / up)


def _scale(responses: np.ndarray, dataset: Dataset, rows: np.ndarray) -> float:
    distances = np.linalg.norm(
        dataset.emitters.positions - dataset.listeners.positions, axis=1
    )
    level = np.zeros(len(rows))
    for start in range(0, len(rows), CHUNK_ROWS):
        part = rows[start : start + CHUNK_ROWS]
        peaks = np.abs(responses[part]).max(axis=1).astype(np.float64)
        level[start : start + CHUNK_ROWS] = peaks * np.maximum(
            distances[part], NEAREST_DISTANCE_M
        )
    heard = level[level > 0]
    if not len(heard):
        return 1.0
    # Squares of the loudest row must fit into float32, whatever the others are.
    return float(max(np.median(heard), heard.max() / LOUDEST))


def _frame(
    dataset: Dataset, rate: float, n_samples: int, scale: float, seed: int
) -> SceneFrame:
    ends = np.vstack([dataset.emitters.positions, dataset.listeners.positions])
    if not np.isfinite(ends).all():
        raise SignalError("a pose holds NaN or infinity; leave its row out")
    rooms = [room for room in dataset.rooms if room is not None]
    room = rooms[0] if len(rooms) == 1 else None
    shape = known_shape(dataset)
    rng = np.random.default_rng(seed)
    if shape is not None:
        points = shape.points(SURFACE_POINTS, rng=rng)
    else:
        points = sample_surface(room, ends, SURFACE_POINTS, rng=rng)
    return SceneFrame(
        low=ends.min(axis=0),
        high=ends.max(axis=0),
        sample_rate=rate,
        n_samples=n_samples,
        speed_of_sound=speed_of_sound(_temperature(dataset)),
        scale=scale,
        surface_points=points,
        simulated=bool(dataset.simulated),
        room=room,
        emitter_gain=dataset.emitter_gain,
        listener_gain=dataset.listener_gain,
        shape=shape,
    )


def _temperature(dataset: Dataset) -> float:
    if "temperature_c" not in dataset.table:
        return 20.0
    measured = np.asarray(dataset.table["temperature_c"], dtype=np.float64)
    known = measured[np.isfinite(measured)]
    return float(np.median(known)) if len(known) else 20.0
