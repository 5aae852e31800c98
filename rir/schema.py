"""What a stored file says of its kind and version, and how an older one is read."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rir.errors import DatasetError, ResoundingError

__all__ = ["Migration", "Schema"]

Migration = Callable[[dict[str, Any]], dict[str, Any]]
"""Turns the content of one version into that of the next."""


@dataclass(frozen=True)
class Schema:
    """One kind of stored file.

    A file holds the number of the version that wrote it. One of an older program
    is brought up to date in memory, step by step, when it is opened; the file stays
    as it is until its content is saved anew.

    Examples
    --------
    >>> scores = Schema("score table", 2, {1: lambda old: {"rows": [old["row"]]}})
    >>> scores.open({"schema": 1, "row": 0.5}, "a.json")
    {'rows': [0.5], 'schema': 2}
    >>> scores.open({"schema": 3}, "b.json")
    Traceback (most recent call last):
    rir.errors.DatasetError: b.json is a score table of version 3; this program reads \
up to 2: update it (pip install -U resounding)
    """

    kind: str
    """What such a file is, in words; opens every message."""
    version: int
    """What this program writes."""
    migrations: Mapping[int, Migration] = field(default_factory=dict)
    """For each older version, what makes the next one of its content."""
    format: str = ""
    """The name that such a file gives itself; "" where it gives none."""
    key: str = "schema"
    """Where the number stands."""
    unnumbered: int | None = None
    """Version of files without a number; such files are refused by default."""
    error: type[ResoundingError] = DatasetError
    """What is raised."""

    def __post_init__(self) -> None:
        if set(self.migrations) != set(range(1, self.version)):
            raise ValueError(f"{self.kind}: every version before the last migrates")

    @property
    def stamp(self) -> dict[str, Any]:
        """What a new file says of itself: its format, where it has one, and version."""
        named = {"format": self.format} if self.format else {}
        return {**named, self.key: self.version}

    def open(self, content: Any, origin: str | Path) -> dict[str, Any]:
        """Return what a file holds, as the present version has it.

        Parameters
        ----------
        content : mapping
            What was read; not changed.
        origin : str or Path
            Names the file in messages.

        Raises
        ------
        ResoundingError
            The schema's own error: if the file is of another kind, says no version,
            or was written by a newer program.
        """
        if not isinstance(content, Mapping):
            raise self.error(f"{origin} is no {self.kind}")
        present = dict(content)
        named = present.get("format", self.format)
        if named != self.format:
            raise self.error(f"{origin} is no {self.kind}: its format is {named!r}")
        if self.format and "format" not in present:
            raise self.error(f"{origin} is no {self.kind}: it says no format")
        for version in range(self._version_of(present, origin), self.version):
            present = self.migrations[version](present)
            present[self.key] = version + 1
        return present

    def _version_of(self, content: Mapping[str, Any], origin: str | Path) -> int:
        said = content.get(self.key, self.unnumbered)
        try:
            version = int(said)  # pyright: ignore[reportArgumentType]
        except (TypeError, ValueError, OverflowError):
            version = 0
        if version < 1 or (isinstance(said, float) and version != said):
            raise self.error(f"{origin} is no {self.kind}: it says no version")
        if version > self.version:
            raise self.error(
                f"{origin} is a {self.kind} of version {version}; this program reads"
                f" up to {self.version}: update it (pip install -U resounding)"
            )
        return version
