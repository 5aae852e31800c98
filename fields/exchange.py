"""Emitter-listener exchange: each response also belongs to the swapped poses."""

import numpy as np

from fields.data import FieldData
from rir import Poses
from rir.errors import TrainingError

__all__ = ["EXCHANGE_MODES", "exchanged", "swapped_ends"]

EXCHANGE_MODES = ("pose", "position")


def swapped_ends(
    emitters: Poses, listeners: Poses, mode: str = "pose"
) -> tuple[Poses, Poses]:
    """Swap the two ends.

    Parameters
    ----------
    emitters, listeners : Poses
        The two ends, equally many.
    mode : str
        "pose" swaps position and orientation; "position" leaves each device
        its orientation, for data where only one end has any (RAF).

    Returns
    -------
    tuple of Poses
        The new emitters and the new listeners.

    Raises
    ------
    TrainingError
        If ``mode`` is unknown.
    """
    if mode == "pose":
        return listeners, emitters
    if mode == "position":
        return (
            Poses(listeners.positions, emitters.orientations),
            Poses(emitters.positions, listeners.orientations),
        )
    raise TrainingError(
        f"no exchange mode {mode!r}; known: {', '.join(EXCHANGE_MODES)}"
    )


def exchanged(data: FieldData, mode: str = "pose") -> FieldData:
    """Return the data followed by its swapped twin, twice as many rows."""
    emitters, listeners = swapped_ends(data.emitters, data.listeners, mode)
    return FieldData(
        np.concatenate([data.responses, data.responses]),
        _joined(data.emitters, emitters),
        _joined(data.listeners, listeners),
        data.frame,
    )


def _joined(first: Poses, second: Poses) -> Poses:
    return Poses(
        np.vstack([first.positions, second.positions]),
        np.vstack([first.orientations, second.orientations]),
    )
