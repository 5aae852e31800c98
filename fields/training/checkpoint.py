"""The state of a training on disk, replaced in one move."""

import os
from pathlib import Path
from typing import Any

import torch

from rir.errors import TrainingError
from rir.schema import Schema

__all__ = ["CHECKPOINT", "TRAINING", "read_checkpoint", "write_checkpoint"]

CHECKPOINT = "checkpoint.pt"
TRAINING = Schema("training checkpoint", 1, unnumbered=1, error=TrainingError)
"""The state of a training; the first ones bear no number."""


def write_checkpoint(folder: Path, state: dict[str, Any]) -> None:
    """Write a state so that a kill at any moment leaves an old or a new one."""
    folder.mkdir(parents=True, exist_ok=True)
    waiting = folder / (CHECKPOINT + ".part")
    torch.save({**TRAINING.stamp, **state}, waiting)
    os.replace(waiting, folder / CHECKPOINT)


def read_checkpoint(folder: Path) -> dict[str, Any] | None:
    """Return the state in a folder, None when there is none.

    Raises
    ------
    TrainingError
        If the file cannot be read.
    """
    path = folder / CHECKPOINT
    if not path.exists():
        return None
    try:
        state = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:
        raise TrainingError(
            f"{path} cannot be read ({error}); remove it to start afresh"
        ) from error
    return TRAINING.open(state, path)
