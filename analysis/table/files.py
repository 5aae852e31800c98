"""Responses from any file a person has: sound, SOFA, data set, session folder."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rir import GainPattern
from rir.dataset import Dataset
from rir.errors import SignalError
from rir.files.audio import read_audio
from rir.files.sofa import open_sofa, rate_of

__all__ = ["FileResponses", "read_responses"]

ROWS_AT_ONCE = 256
"""Responses in memory: 98 MB where they last 1 s at 48 kHz."""


@dataclass(frozen=True)
class FileResponses:
    """Some responses of one file."""

    file: str
    """Name of the file."""
    labels: list[str]
    """What tells the responses of the file apart."""
    samples: NDArray[np.float64]
    """Responses. Shape (k, n)."""
    sample_rate: int
    """Samples per second [Hz]."""
    mark: str = ""
    """SIMULATED or MEASURED where the file says so, else empty."""
    unit_source: bool = False
    """Whether the emitter is known to be an omnidirectional pulse of 1 at 1 m."""


def read_responses(path: str | Path) -> Iterator[FileResponses]:
    """Yield the responses of a file, a few hundred at a time.

    Parameters
    ----------
    path : path
        WAV, FLAC or another sound file; SOFA; HDF5 data set; session folder.

    Raises
    ------
    SignalError, DatasetError
        If the file cannot be read as what its name says.
    """
    place = Path(path)
    if not place.exists():
        raise SignalError(f"no file {place}")
    if place.is_dir() or place.suffix.lower() in {".h5", ".hdf5"}:
        yield from _of_dataset(place)
    elif place.suffix.lower() == ".sofa":
        yield _of_sofa(place)
    else:
        samples, rate = read_audio(place)
        labels = [f"channel {k}" for k in range(len(samples))]
        yield FileResponses(place.name, labels, samples, rate)


def _of_dataset(path: Path) -> Iterator[FileResponses]:
    dataset = Dataset.open(path)
    takes = dataset.table["take_id"]
    ideal = _has_ideal_source(dataset)
    for start in range(0, len(dataset), ROWS_AT_ONCE):
        rows = range(start, min(start + ROWS_AT_ONCE, len(dataset)))
        yield FileResponses(
            path.name,
            [str(takes[row]) or f"row {row}" for row in rows],
            np.asarray(dataset.responses[list(rows)], float),
            dataset.sample_rate,
            dataset.mark,
            ideal,
        )


def _has_ideal_source(dataset: Dataset) -> bool:
    """Return whether the room simulator wrote it, with no pattern on the emitter.

    A simulated session has electronics in it, whose gain nobody states.
    """
    written = all("plan" in session for session in dataset.sessions)
    gain = dataset.emitter_gain
    return dataset.simulated and written and gain in (None, GainPattern.omni())


def _of_sofa(path: Path) -> FileResponses:
    sofa = open_sofa(path, SignalError)
    try:
        samples = np.asarray(sofa.Data_IR, float)
    except (AttributeError, ValueError) as error:
        raise SignalError(f"{path} holds no impulse responses: {error}") from error
    lead = samples.shape[:-1]
    labels = [" ".join(map(str, index)) for index in np.ndindex(*lead)]
    flat = samples.reshape(-1, samples.shape[-1])
    return FileResponses(path.name, labels, flat, round(rate_of(sofa)))
