"""A fitted box as plain arrays, and back."""

from typing import Any

import numpy as np

from inverse.array_parts import part_of, prefixed
from inverse.bands.banded_room import BandedRoom
from inverse.bands.fitted_bands import FittedBandedRoom
from inverse.paths.coloring import Coloring
from inverse.paths.oriented_box import OrientedBox
from inverse.paths.room import BoxRoom
from inverse.paths.shoebox import FittedRoom

__all__ = ["room_arrays", "room_from"]


def room_arrays(fitted: FittedRoom) -> dict[str, Any]:
    """Return a fitted box as named plain values."""
    room = fitted.room
    return {
        **_banded_arrays(fitted),
        **prefixed("box", vars(room.box)),
        **room.as_arrays(),
        "coloring": fitted.coloring.factors,
        "covariance": fitted.covariance,
        "active": fitted.active,
    }


def _banded_arrays(fitted: FittedRoom) -> dict[str, Any]:
    if not isinstance(fitted, FittedBandedRoom):
        return {}
    arrays = prefixed("banded", fitted.banded.as_arrays())
    return arrays if fitted.tones is None else arrays | {"tones": fitted.tones}


def room_from(arrays: dict[str, np.ndarray]) -> FittedRoom:
    """Rebuild what :func:`room_arrays` named."""
    room = BoxRoom(OrientedBox(**part_of(arrays, "box")), **BoxRoom.parts_of(arrays))
    coloring = Coloring(arrays["coloring"], room.sample_rate)
    fitted = room, coloring, arrays["covariance"], arrays["active"]
    parts = part_of(arrays, "banded")
    if not parts:
        return FittedRoom(*fitted)
    banded = BandedRoom.from_arrays(room, parts)
    return FittedBandedRoom(*fitted, banded, arrays.get("tones"))
