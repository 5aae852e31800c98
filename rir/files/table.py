"""The table of file formats of other tools."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rir import Dataset, DatasetError, Registry

__all__ = ["FORMATS", "Format", "is_simulated", "read_about", "write_about"]

ABOUT = "about.json"
LABELS = ("pair_id", "direction", "take_id", "temperature_c")


@dataclass(frozen=True)
class Format:
    """One format."""

    about: str
    """One line for the lists."""
    read: Callable[[Path, bool | None], Dataset]
    """Takes a path and whether the data are simulated (None: the file says so); returns
    a data set."""
    write: Callable[[Dataset, Path], None]
    """Takes a data set and a path."""
    suffix: str = ""
    """How its files end; empty for a format that is a folder."""
    holds: str = ""
    """Pattern of a file by which such a folder is recognised."""

    def suits(self, path: Path) -> bool:
        """Say whether a path looks like this format."""
        if self.suffix:
            return path.suffix == self.suffix
        return bool(self.holds) and path.is_dir() and any(path.glob(self.holds))


FORMATS: Registry[Format] = Registry("format", "resounding.formats", Format)


def write_about(dataset: Dataset, folder: Path, **more: Any) -> None:
    """Write what a folder of responses is, beside them."""
    about = {
        "format": "resounding export",
        "mark": dataset.mark,
        "simulated": dataset.simulated,
        "sample_rate": dataset.sample_rate,
        "rooms": dataset.room_names,
        **more,
    }
    (folder / ABOUT).write_text(json.dumps(about, indent=1, sort_keys=True))


def read_about(folder: Path) -> dict[str, Any]:
    """Return what a folder says of itself; nothing if it says nothing."""
    path = folder / ABOUT
    return json.loads(path.read_text()) if path.exists() else {}


def is_simulated(said: bool | None, about: dict[str, Any], path: Path) -> bool:
    """Return whether responses are simulated; never guess.

    Raises
    ------
    DatasetError
        If neither the caller nor the files say, or the caller contradicts the files.
    """
    written = about.get("simulated", said)
    if written is None:
        raise DatasetError(
            f"{path} does not say whether its responses were measured; "
            "give --measured or --simulated"
        )
    if said not in (None, bool(written)):
        mark, flag = ("SIMULATED", "measured") if written else ("MEASURED", "simulated")
        raise DatasetError(f"{path} says {mark}: leave out --{flag}")
    return bool(written)


def labels(dataset: Dataset) -> dict[str, np.ndarray]:
    """Return the columns that other tools can carry along."""
    return {name: np.asarray(dataset.table[name]) for name in LABELS}
