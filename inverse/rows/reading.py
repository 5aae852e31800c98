"""Rows to find a room in, read from a data set."""

import numpy as np
from numpy.typing import NDArray

from inverse.rows.fitset import FitSet, place_numbers
from rir import Dataset, Poses
from rir.errors import DatasetError
from rir.physics import speed_of_sound
from rir.recording_blocks import (
    RecordingBlocks,
    median_temperature,
    recording_blocks,
)
from rir.scaled_responses import scaled_responses

__all__ = ["as_rows", "read_rows"]


def read_rows(
    dataset: Dataset, *, sample_rate: float | None = None, duration: float | None = None
) -> FitSet:
    """Read a data set's responses, scaled so that a direct sound is about 1/distance.

    Parameters
    ----------
    dataset : Dataset
        Any number of sessions of one room.
    sample_rate : float, optional
        Rate to resample to, hertz; the data's own by default.
    duration : float, optional
        Length to keep from the emission on, seconds; all by default.

    Raises
    ------
    DatasetError
        If there are no responses.
    SignalError
        If a response or a pose holds NaN or infinity.
    """
    if len(dataset) == 0:
        raise DatasetError("the data set holds no responses: no room to find in it")
    scaled = scaled_responses(dataset, sample_rate=sample_rate, duration=duration)
    return as_rows(
        scaled.responses,
        dataset.emitters,
        dataset.listeners,
        scaled.sample_rate,
        speed_of_sound(median_temperature(dataset)),
        recording_blocks(dataset),
    )


def as_rows(
    responses: NDArray,
    emitters: Poses,
    listeners: Poses,
    sample_rate: float,
    speed: float,
    recording: RecordingBlocks | None = None,
) -> FitSet:
    """Return responses with their poses as rows to find a room in.

    Parameters
    ----------
    responses : ndarray, shape (rows, n_samples)
        A direct sound is about 1/distance.
    emitters, listeners : Poses
        One pose a row.
    sample_rate : float
        Hertz.
    speed : float
        Of sound at the temperature of the air, metres per second.
    recording : RecordingBlocks, optional
        When the rows were recorded; one block when unknown.
    """
    blocks = np.zeros(len(responses), dtype=np.int64)
    return FitSet(
        np.asarray(responses, dtype=np.float64),
        emitters,
        listeners,
        float(sample_rate),
        float(speed),
        place_numbers(emitters.positions),
        blocks if recording is None else recording.blocks,
        None if recording is None else recording.temperatures,
    )
