"""Rows of responses on disk and in memory, read alike."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rir.config import parse_yaml, validate
from rir.errors import DatasetError
from rir.gain import GainPattern
from rir.layout import DATA_SET
from rir.pose import Poses
from rir.room import RoomSpec

__all__ = ["FilePart", "MemoryPart", "Part", "locate"]

_SUFFIXES = {".h5", ".hdf5"}


@dataclass(frozen=True)
class MemoryPart:
    """Rows held in arrays."""

    samples: NDArray[Any]
    sample_rate: int
    emitters: Poses
    listeners: Poses
    simulated: bool
    pre: int = 0
    session: str = "memory"
    room_name: str = ""
    room: RoomSpec | None = None
    metadata: Mapping[str, Any] = field(default_factory=dict)
    gains: Mapping[str, GainPattern] = field(default_factory=dict)
    table: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    extras: Mapping[str, NDArray[Any]] = field(default_factory=dict)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and stored samples per row."""
        return self.samples.shape[0], self.samples.shape[1]

    def read(self, rows: NDArray[np.intp]) -> NDArray[Any]:
        """Return the stored samples of the given rows."""
        return self.samples[rows]


def locate(path: str | Path) -> Path:
    """Return the data-set file meant by a path: itself, or a session folder's.

    Raises
    ------
    DatasetError
        If there is none; says what to do.
    """
    place = Path(path)
    if place.is_dir():
        inside = place / "dataset.h5"
        if inside.is_file():
            return inside
        if (place / "journal.jsonl").is_file():
            raise DatasetError(
                f"{place} is a session without dataset.h5: resume it, or rebuild it"
                f" with capture-pairs rebuild {place}"
            )
        raise DatasetError(f"{place} holds no dataset.h5: not a session folder")
    if not place.exists():
        raise DatasetError(f"{place} does not exist")
    if place.suffix.lower() not in _SUFFIXES:
        raise DatasetError(f"{place} is not a data set (.h5) or a session folder")
    return place


class FilePart:
    """Rows in an HDF5 file, read when asked for.

    The file is opened on first use in each process, so parts can be sent to
    worker processes.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = locate(path)
        self._file: Any = None
        self._header = DATA_SET.open(dict(self._open().attrs), self.path)
        missing = {"responses", "emitter", "listener"} - set(self._open())
        if missing:
            raise DatasetError(
                f"{self.path} lacks {', '.join(sorted(missing))}: broken or cut short"
            )

    def _open(self) -> Any:
        if self._file is None:
            import h5py

            try:
                self._file = h5py.File(self.path, "r")
            except OSError as error:
                raise DatasetError(
                    f"{self.path} cannot be read as HDF5 ({error}); if it belongs to a"
                    " session, rebuild it with capture-pairs rebuild"
                ) from error
        return self._file

    def __getstate__(self) -> dict[str, Any]:
        return {"path": self.path, "_header": self._header, "_file": None}

    def close(self) -> None:
        """Close the file; the next use opens it again."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def _attribute(self, name: str, default: Any) -> Any:
        value = self._header.get(name, default)
        return value.item() if isinstance(value, np.generic) else value

    @property
    def sample_rate(self) -> int:
        """Samples per second [Hz]."""
        return int(self._attribute("sample_rate", 0))

    @property
    def pre(self) -> int:
        """Samples stored before the emission."""
        return int(self._attribute("pre", 0))

    @property
    def simulated(self) -> bool:
        """Whether no microphone heard it."""
        return bool(self._attribute("simulated", True))

    @property
    def session(self) -> str:
        """Identifier of the session."""
        return str(self._attribute("session", self.path.stem))

    @property
    def room_name(self) -> str:
        """Name of the room; empty when unknown."""
        return str(self._attribute("room_name", ""))

    @cached_property
    def room(self) -> RoomSpec | None:
        """The room, where the file says it."""
        text = self._attribute("room", "")
        if not text:
            return None
        origin = f"room in {self.path}"
        return validate(parse_yaml(text, origin=origin), RoomSpec, origin=origin)

    @cached_property
    def metadata(self) -> Mapping[str, Any]:
        """Everything else the session says of itself."""
        extra = {
            name: self._attribute(name, "") for name in ("software", "created_utc")
        }
        return {**json.loads(self._attribute("metadata", "{}")), **extra}

    @cached_property
    def emitters(self) -> Poses:
        """Emitter poses, one per row."""
        return self._poses("emitter")

    @cached_property
    def listeners(self) -> Poses:
        """Listener poses, one per row."""
        return self._poses("listener")

    def _poses(self, end: str) -> Poses:
        group = self._open()[end]
        return Poses(group["position"][:], group["orientation"][:])

    @cached_property
    def gains(self) -> Mapping[str, GainPattern]:
        """Gain patterns of ``emitter`` and ``listener``, where known."""
        groups = self._open().get("gain", {})
        return {
            end: GainPattern(group["coefficients"][:], group["bands"][:])
            for end, group in groups.items()
        }

    @cached_property
    def table(self) -> Mapping[str, NDArray[Any]]:
        """Columns, one value per row."""
        columns = {}
        for name, stored in self._open().get("table", {}).items():
            values = stored[:]
            text = values.dtype.kind == "S"
            columns[name] = np.char.decode(values, "utf-8") if text else values
        return columns

    @property
    def extras(self) -> Mapping[str, NDArray[Any]]:
        """Further arrays, such as the excitation."""
        return {name: s[...] for name, s in self._open().get("extra", {}).items()}

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and stored samples per row."""
        return self._open()["responses"].shape

    def read(self, rows: NDArray[np.intp]) -> NDArray[Any]:
        """Return the stored samples of the given rows, in the order asked."""
        stored = self._open()["responses"]
        if not len(rows):
            return np.empty((0, stored.shape[1]), dtype=stored.dtype)
        if np.array_equal(rows, np.arange(rows[0], rows[0] + len(rows))):
            return stored[rows[0] : rows[0] + len(rows)]
        wanted, order = np.unique(rows, return_inverse=True)
        return stored[wanted][order]


Part = FilePart | MemoryPart
"""Rows with one sample rate and one origin."""
