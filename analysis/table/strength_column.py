"""The sound strength of responses of a file, or why it cannot be known."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from analysis.sound_strength import reference_energy, strength
from analysis.table.files import FileResponses, read_responses
from rir.arrays import FloatArray
from rir.errors import SignalError

__all__ = ["UNKNOWN", "FreeField", "add_strength", "read_reference"]

UNKNOWN = (
    "how loud the source is in the free field is unknown: give --reference and "
    "--reference-distance"
)


@dataclass(frozen=True)
class FreeField:
    """What a source sounds like without a room."""

    samples: FloatArray
    """Responses around the source, reflections cut off. Shape (angles, n)."""
    sample_rate: int
    """Samples per second [Hz]."""
    distance: float
    """Distance of the microphone [m]."""

    def energy(self, centers: FloatArray | None) -> FloatArray:
        """Return the energy at 10 m, shape () or (bands,)."""
        return reference_energy(self.samples, self.sample_rate, self.distance, centers)


def read_reference(path: Path, distance: float | None) -> FreeField:
    """Return the free-field reference a file holds, all its responses as angles.

    Raises
    ------
    SignalError
        If the distance is missing or not positive, or the file has no responses of one
        sample rate.
    """
    if distance is None or not 0 < distance < np.inf:
        raise SignalError(
            f"the reference {path.name} needs its distance in metres: give "
            f"--reference-distance, above 0; not {distance}"
        )
    parts = list(read_responses(path))
    if not parts:
        raise SignalError(f"the reference {path.name} holds no responses")
    samples = np.concatenate([part.samples for part in parts])
    return FreeField(samples, parts[0].sample_rate, distance)


def add_strength(
    part: FileResponses,
    centers: FloatArray,
    reference: FreeField | None,
    lines: list[dict[str, Any]],
) -> None:
    """Enter G, or why there is none, into the lines of one file.

    Parameters
    ----------
    part : FileResponses
    centers : ndarray, shape (bands,)
        Bands that follow each broadband line.
    reference : FreeField, optional
        The source in the free field; an ideal pulse of 1 at 1 m where the file says
        that its responses are of that.
    lines : list of dict
        One for each response and band, in that order.
    """
    known = reference or (_pulse(part.sample_rate) if part.unit_source else None)
    reason = UNKNOWN
    if known is not None and known.sample_rate != part.sample_rate:
        reason = (
            f"the reference has {known.sample_rate} Hz, the response "
            f"{part.sample_rate} Hz"
        )
        known = None
    values = np.full((len(part.labels), 1 + len(centers)), np.nan)
    if known is not None:
        reason = "no decay that can be told from the noise"
        rate, own = part.sample_rate, part.samples
        values[:, 0] = strength(own, rate, known.energy(None))
        if len(centers):
            values[:, 1:] = strength(own, rate, known.energy(centers), centers)
    for line, value in zip(lines, values.ravel(), strict=True):
        line["G"] = float(value)
        if np.isnan(value):
            line["reasons"]["G"] = reason


def _pulse(sample_rate: int) -> FreeField:
    samples = np.zeros((1, sample_rate))
    samples[0, sample_rate // 100] = 1.0
    return FreeField(samples, sample_rate, 1.0)
