"""The folder of a session: what lies where, and how files get there safely."""

import hashlib
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.config import SESSION, SessionConfig
from rir import SessionError, SignalError
from rir.config import dump_yaml, load_yaml
from rir.files.audio import read_audio, write_audio

__all__ = ["SessionFolder", "file_sha256", "lossless_format"]

FLAC_CHANNELS = 8  # the format's limit (RFC 9639)
STEP_24_BIT = 2.0**-23  # one step of a 24-bit converter, full scale 1


@dataclass(frozen=True)
class SessionFolder:
    """Names of everything in a session's folder."""

    path: Path

    @property
    def config_path(self) -> Path:
        """The effective configuration."""
        return self.path / "session.yaml"

    @property
    def journal_path(self) -> Path:
        """The events, the truth for resume."""
        return self.path / "journal.jsonl"

    @property
    def raw_path(self) -> Path:
        """The folder of the takes."""
        return self.path / "raw"

    @property
    def dataset_path(self) -> Path:
        """The data set derived from all the rest."""
        return self.path / "dataset.h5"

    @property
    def exists(self) -> bool:
        """Whether a session was planned here."""
        return self.config_path.exists()

    def create(self, config: SessionConfig) -> None:
        """Make the folder and write the configuration.

        Raises
        ------
        SessionError
            If a session is here already, or the folder cannot be made.
        """
        if self.exists:
            raise SessionError(f"{self.path} holds a session already; resume it")
        try:
            self.raw_path.mkdir(parents=True, exist_ok=True)
            write_text(self.config_path, dump_yaml(config))
        except OSError as error:
            raise SessionError(
                f"cannot make {self.path}: {error.strerror}; choose another --out"
            ) from error

    def load_config(self) -> SessionConfig:
        """Read the configuration.

        Raises
        ------
        SessionError
            If no session was planned here.
        """
        if not self.exists:
            raise SessionError(
                f"{self.path} is no session folder (it has no session.yaml)"
            )
        return load_yaml(self.config_path, SessionConfig, SESSION)

    def write_raw(
        self, take: str, samples: NDArray[np.float64], sample_rate: int
    ) -> Path:
        """Write all input channels of a take, whole or not at all.

        Parameters
        ----------
        take : str
            Name of the take.
        samples : ndarray, shape (channels, n_samples)
            What the inputs heard.
        sample_rate : int
            Rate [Hz].

        Raises
        ------
        SessionError
            If the disk does not take it; nothing half-written stays.
        """
        suffix, subtype = lossless_format(samples)
        path = self.raw_path / f"{take}{suffix}"
        try:
            write_audio(path, samples, sample_rate, subtype)
        except SignalError as error:
            raise SessionError(
                f"{error}; free some space and run again: the session resumes"
            ) from error
        sync_folder(self.raw_path)
        return path

    def read_raw(self, name: str) -> NDArray[np.float64]:
        """Return a raw file's samples, shape (channels, n_samples)."""
        return read_audio(self.path / name)[0]

    def sweep_partials(self) -> list[Path]:
        """Remove what an ended process left half-written, and return the names."""
        partials = sorted(self.raw_path.glob(".*.partial"))
        for path in partials:
            path.unlink()
        return partials


def lossless_format(samples: NDArray[np.float64]) -> tuple[str, str]:
    """Return suffix and subtype of the smallest format that keeps every bit.

    Examples
    --------
    >>> lossless_format(np.array([[0.5, -0.25]]))
    ('.flac', 'PCM_24')
    >>> lossless_format(np.array([[1e-9, 0.1]]))
    ('.wav', 'DOUBLE')
    """
    steps = samples / STEP_24_BIT
    whole = np.array_equal(steps, np.round(steps))
    if whole and samples.max() < 1.0 and samples.min() >= -1.0:
        return (".flac" if len(samples) <= FLAC_CHANNELS else ".wav"), "PCM_24"
    narrow = np.array_equal(samples, samples.astype(np.float32))
    return ".wav", "FLOAT" if narrow else "DOUBLE"


def file_sha256(path: Path) -> str:
    """Return the SHA-256 of a file's bytes."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def sync_folder(path: Path) -> None:
    """Wait until the disk knows the names in a folder, where it can be told."""
    if os.name == "nt":
        return
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def write_text(path: Path, text: str) -> None:
    """Write a text file so that a crash leaves the old one or the new one."""
    partial = path.with_name(f".{path.name}.partial")
    with partial.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    partial.replace(path)
    sync_folder(path.parent)
