"""The file of a field, and fields that answer from the responses stored in it."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from fields.data import FieldData
from fields.exchange import exchanged
from fields.frame import SceneFrame
from fields.plan import TrainingPlan
from rir import Poses
from rir.errors import TrainingError
from rir.schema import Schema

__all__ = [
    "FIELD",
    "learned_rows",
    "load_stored",
    "naming_missing_parts",
    "read_arrays",
    "save_stored",
    "write_arrays",
]

FIELD = Schema("field", 1, unnumbered=1, error=TrainingError)
"""The file of every model; the first ones without torch bear no number."""


def learned_rows(data: FieldData, plan: TrainingPlan) -> FieldData:
    """Return the rows a baseline keeps, doubled when ends are exchanged."""
    if plan.exchange == "none":
        return data
    return exchanged(data, plan.exchange_mode)


def write_arrays(
    path: str | Path, model: str, config: Any, frame: SceneFrame, arrays: dict[str, Any]
) -> Path:
    """Write a field without torch as one uncompressed archive ending in .npz."""
    target = Path(path).with_suffix(".npz")
    np.savez(
        target,
        **FIELD.stamp,
        model=np.array(model),
        config=np.array(json.dumps(asdict(config))),
        frame=np.array(json.dumps(frame.as_dict())),
        **arrays,
    )
    return target


def save_stored(path: Path, model: str, config: Any, data: FieldData) -> Path:
    """Write a baseline's rows."""
    arrays = {
        "responses": data.responses,
        "emitters": data.emitters.positions,
        "emitter_orientations": data.emitters.orientations,
        "listeners": data.listeners.positions,
        "listener_orientations": data.listeners.orientations,
    }
    return write_arrays(path, model, config, data.frame, arrays)


def load_stored(path: Path) -> tuple[dict[str, Any], FieldData]:
    """Read what :func:`save_stored` wrote: the configuration and the rows."""
    stored = read_arrays(path)
    data = FieldData(
        stored["responses"],
        Poses(stored["emitters"], stored["emitter_orientations"]),
        Poses(stored["listeners"], stored["listener_orientations"]),
        SceneFrame.from_dict(json.loads(str(stored["frame"]))),
    )
    return json.loads(str(stored["config"])), data


@contextmanager
def naming_missing_parts(path: Path) -> Iterator[None]:
    """Say which part a file lacks, as those of older programs do."""
    try:
        yield
    except KeyError as missing:
        raise TrainingError(
            f"{path} holds no {missing} of a field: an older program wrote it; "
            "train the field again"
        ) from missing


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """Return what the file of a field without torch holds, by name.

    Raises
    ------
    TrainingError
        If the file was written by a newer program.
    """
    with np.load(path, allow_pickle=False) as stored:
        return FIELD.open(stored, path)
