"""Recordings of sweeps made with other programs: deconvolve a folder of them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from capture.deconvolution.deconvolve import deconvolve
from rir import Dataset, DatasetError
from rir.files.audio import read_audio
from rir.files.table import is_simulated, read_about
from rir.files.wav import POSES, columns_of, poses_of, read_poses

__all__ = ["PlayedSweep", "read_recordings"]


@dataclass(frozen=True)
class PlayedSweep:
    """What was played into the recordings of a folder."""

    path: Path
    """The sound file that was played."""
    loopback: int | None = None
    """Channel of each recording that carries the loopback (from 1)."""
    band_hz: tuple[float, float] | None = None
    """Flat part of the responses; what the excitation covers if left out."""
    seconds: float = 1.0
    """Length of the responses."""


def read_recordings(
    path: Path, excitation: PlayedSweep, simulated: bool | None
) -> Dataset:
    """Deconvolve the recordings of a folder with a ``poses.csv``.

    The table is that of a folder of responses; ``channel`` names the microphone.

    Raises
    ------
    DatasetError
        If a recording has another rate than the excitation, or too few channels.
    """
    rows = read_poses(path / POSES)
    played, rate = read_audio(excitation.path)
    length = round(excitation.seconds * rate)
    responses = []
    for row in rows:
        samples, own_rate = read_audio(path / row["file"])
        if own_rate != rate:
            raise DatasetError(
                f"{row['file']} has {own_rate} Hz, the excitation {rate} Hz"
            )
        channel = int(row.get("channel") or 1)
        looped = excitation.loopback
        if max(channel, looped or 1) > len(samples):
            raise DatasetError(
                f"{row['file']} has {len(samples)} channels; "
                f"{max(channel, looped or 1)} was named"
            )
        result = deconvolve(
            samples[channel - 1],
            played[0],
            rate,
            loopback=samples[looped - 1] if looped else None,
            band=excitation.band_hz,
            length=length,
        )
        responses.append(result.response)
    return Dataset.from_arrays(
        np.stack(responses),
        poses_of(rows, "emitter"),
        poses_of(rows, "listener"),
        sample_rate=rate,
        simulated=is_simulated(simulated, read_about(path), path),
        session=path.resolve().name,
        columns=columns_of(rows),
    )
