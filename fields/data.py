"""Responses and poses made ready for training: one rate, one length, one scale."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fields.frame import SceneFrame
from fields.shape import known_shape
from fields.surfaces import sample_surface
from rir import Dataset, Poses
from rir.errors import DatasetError, SignalError
from rir.physics import speed_of_sound
from rir.recording_blocks import (
    RecordingBlocks,
    median_temperature,
    recording_blocks,
)
from rir.scaled_responses import ScaledResponses, scaled_responses

__all__ = ["FieldData", "check_dataset", "prepare"]

SURFACE_POINTS = 1024
"""Points that stand for a room's surfaces: one each 0.1 m2 of a living room."""


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
    scaled = scaled_responses(
        dataset,
        sample_rate=sample_rate,
        duration=duration,
        level_rows=train_rows,
        store=store,
    )
    return FieldData(
        scaled.responses,
        dataset.emitters,
        dataset.listeners,
        _frame(dataset, scaled, seed),
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


def _frame(dataset: Dataset, scaled: ScaledResponses, seed: int) -> SceneFrame:
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
        sample_rate=scaled.sample_rate,
        n_samples=scaled.responses.shape[1],
        speed_of_sound=speed_of_sound(median_temperature(dataset)),
        scale=scaled.scale,
        surface_points=points,
        simulated=bool(dataset.simulated),
        room=room,
        emitter_gain=dataset.emitter_gain,
        listener_gain=dataset.listener_gain,
        shape=shape,
    )
