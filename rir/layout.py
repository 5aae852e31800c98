"""The layout of a data-set file, version 1.

A file holds N rows; one row is one response from one emitter to one listener.

======================  ==========  ==================================================
name                    shape       content
======================  ==========  ==================================================
``responses``           (N, pre+n)  float32 or float64, ``pre`` samples before emission
``emitter/position``    (N, 3)      acoustic centre in the room frame [m]
``emitter/orientation`` (N, 4)      unit quaternion, scalar last
``listener/…``          like the emitter's
``table/<column>``      (N,)        one value per row; see `COLUMNS`
``gain/<end>/…``        -           ``coefficients`` (bands, harmonics), ``bands`` [Hz]
``extra/<name>``        any         excitation and other arrays, each with attributes
======================  ==========  ==================================================

Root attributes: ``format``, ``schema``, ``sample_rate`` [Hz], ``pre``,
``simulated``, ``session``, ``room_name``, ``room`` (YAML), ``metadata`` (JSON),
``software``, ``created_utc``.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rir.schema import Schema

__all__ = ["COLUMNS", "DATA_SET", "empty_column"]

DATA_SET = Schema("data set", 1, format="resounding", unnumbered=1)

COLUMNS: dict[str, Any] = {
    "take_id": "",
    "pair_id": -1,
    "direction": "",
    "take_no": -1,
    "channel": -1,
    "accepted": True,
    "time_utc": "",
    "temperature_c": np.nan,
    "humidity_percent": np.nan,
    "pressure_kpa": np.nan,
    "emitter_id": -1,
    "listener_id": -1,
    "raw_file": "",
    "raw_sha256": "",
    "verdict": "",
    "reasons": "",
}
"""Columns that every reader may ask for, with the value that means *absent*."""


def empty_column(like: NDArray[Any] | None, name: str, count: int) -> NDArray[Any]:
    """Return `count` values that mean *absent* for a column."""
    if name in COLUMNS:
        return np.full(count, COLUMNS[name])
    if like is None or like.dtype.kind == "U":
        return np.full(count, "")
    if like.dtype.kind == "f":
        return np.full(count, np.nan)
    return np.full(count, False if like.dtype.kind == "b" else -1)
