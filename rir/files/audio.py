"""Sound files, with time on the last axis. The only file that imports soundfile."""

import os
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir.errors import SignalError

__all__ = ["read_audio", "write_audio"]

_FLAC_CHANNELS = 8  # the most that the format has (RFC 9639, section 9.1.3)


def read_audio(path: str | Path) -> tuple[NDArray[np.float64], int]:
    """Read a sound file.

    Returns
    -------
    samples : ndarray, shape (channels, n_samples)
        Full scale is 1.0.
    sample_rate : int
        Samples per second [Hz].

    Raises
    ------
    SignalError
        If the file is not a readable sound file, or holds no samples.
    """
    import soundfile

    try:
        frames, rate = soundfile.read(str(path), dtype="float64", always_2d=True)
    except (soundfile.SoundFileError, OSError) as error:
        raise SignalError(f"cannot read {path} as sound: {error}") from error
    if not len(frames):
        raise SignalError(f"{path} holds no samples")
    return np.ascontiguousarray(frames.T, dtype=np.float64), int(rate)


def write_audio(
    path: str | Path, samples: ArrayLike, sample_rate: int, subtype: str = "FLOAT"
) -> Path:
    """Write a sound file so that a crash leaves the old state or the new one.

    Parameters
    ----------
    path : path
        Ends in ``.wav`` or ``.flac``; WAV files beyond 4 GiB become RF64.
    samples : array_like, shape (channels, n_samples) or (n_samples,)
        Full scale is 1.0; beyond it fixed-point formats clip.
    sample_rate : int
        Samples per second [Hz].
    subtype : str
        ``FLOAT``, ``DOUBLE``, ``PCM_24``, … as libsndfile names them.

    Raises
    ------
    SignalError
        If the format cannot hold the channels or the file cannot be written.
    """
    import soundfile

    target = Path(path)
    frames = np.atleast_2d(np.asarray(samples)).T
    container = target.suffix.lower().lstrip(".").upper()
    if container == "FLAC" and frames.shape[1] > _FLAC_CHANNELS:
        raise SignalError(
            f"FLAC holds {_FLAC_CHANNELS} channels, not {frames.shape[1]}: write WAV"
        )
    if container == "WAV" and frames.nbytes > 2**32 - 2**16:
        container = "RF64"
    partial = target.with_name(f".{target.name}.partial")
    try:
        with partial.open("w+b") as stream:
            soundfile.write(
                stream, frames, sample_rate, format=container, subtype=subtype
            )
            _drop_time(stream)
            stream.flush()
            os.fsync(stream.fileno())
        partial.replace(target)
    except (soundfile.SoundFileError, OSError, ValueError, AssertionError) as error:
        partial.unlink(missing_ok=True)
        # soundfile asserts that all was written, and says nothing if not.
        why = str(error) or "only part of it could be written; is the disk full?"
        raise SignalError(f"cannot write {target}: {why}") from error
    return target


def _drop_time(stream: BinaryIO) -> None:
    """Zero the time that libsndfile writes into a floating-point WAV's PEAK chunk.

    The same samples then always give the same bytes.
    """
    stream.seek(0)
    place = stream.read(100).find(b"PEAK")
    if place >= 0:
        stream.seek(place + 12)
        stream.write(bytes(4))
