"""Folders of sound files with a table of poses."""

import csv
from pathlib import Path

import numpy as np

from rir import Dataset, DatasetError, Poses
from rir.files.audio import read_audio, write_audio
from rir.files.table import (
    FORMATS,
    Format,
    is_simulated,
    labels,
    read_about,
    write_about,
)

__all__ = ["POSES", "read_poses", "read_wav", "write_wav"]

POSES = "poses.csv"
AXES = ("x", "y", "z")
TURNS = ("qx", "qy", "qz", "qw")
NEEDED = (
    "file",
    *(f"{end}_{axis}" for end in ("emitter", "listener") for axis in AXES),
)


def read_wav(path: Path, simulated: bool | None) -> Dataset:
    """Read a folder of responses and its ``poses.csv``.

    The table has one row per response: ``file``, ``channel`` (from 1, if a file has
    several), ``emitter_x`` … ``listener_z`` [m], optionally the quaternions
    ``emitter_qx`` … ``listener_qw``, ``pair_id``, ``direction``, ``take_id`` and
    ``temperature_c``. The first sample is the emission.

    Raises
    ------
    DatasetError
        If columns are missing or files do not fit each other.
    """
    rows = read_poses(path / POSES)
    about = read_about(path)
    samples, rate = _read_files(path, rows)
    return Dataset.from_arrays(
        samples,
        poses_of(rows, "emitter"),
        poses_of(rows, "listener"),
        sample_rate=rate,
        simulated=is_simulated(simulated, about, path),
        room_name=", ".join(about.get("rooms", [])),
        session=path.resolve().name,
        columns=columns_of(rows),
    )


def read_poses(path: Path) -> list[dict[str, str]]:
    """Return the rows of a table of poses.

    Raises
    ------
    DatasetError
        If the table or some of its columns are missing.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = list(csv.DictReader(file))
    except OSError as error:
        raise DatasetError(f"cannot read {path}: {error.strerror}") from error
    missing = [name for name in NEEDED if not rows or name not in rows[0]]
    if missing:
        raise DatasetError(f"{path} lacks rows or the columns {', '.join(missing)}")
    return rows


def _read_files(path: Path, rows: list[dict[str, str]]) -> tuple[np.ndarray, int]:
    found = []
    for row in rows:
        samples, rate = read_audio(path / row["file"])
        channel = int(row.get("channel") or 1) - 1
        if not 0 <= channel < len(samples):
            raise DatasetError(
                f"{row['file']} has {len(samples)} channels; {channel + 1} was named"
            )
        found.append((samples[channel], rate))
    rates = {rate for _, rate in found}
    if len(rates) > 1:
        raise DatasetError(f"{path} mixes sample rates: {sorted(rates)} Hz")
    length = max(len(samples) for samples, _ in found)
    padded = [np.pad(samples, (0, length - len(samples))) for samples, _ in found]
    return np.stack(padded), rates.pop()


def poses_of(rows: list[dict[str, str]], end: str) -> Poses:
    """Return one end's poses from the rows of a table.

    Raises
    ------
    DatasetError
        If a number cannot be read; names the row.
    """
    turned = all(row.get(f"{end}_{turn}") for row in rows for turn in TURNS)
    names = [f"{end}_{name}" for name in (*AXES, *(TURNS if turned else ()))]
    table = []
    for number, row in enumerate(rows, start=2):
        try:
            table.append([float(row[name]) for name in names])
        except (TypeError, ValueError) as error:
            raise DatasetError(f"line {number} of the poses: {error}") from error
    return Poses.of(np.array(table))


def columns_of(rows: list[dict[str, str]]) -> dict[str, np.ndarray]:
    """Return the labels of the rows that the table carries."""
    columns: dict[str, np.ndarray] = {}
    for name in ("direction", "take_id"):
        if name in rows[0]:
            columns[name] = np.array([row[name] for row in rows])
    if "pair_id" in rows[0]:
        columns["pair_id"] = np.array([int(row["pair_id"] or -1) for row in rows])
    if "temperature_c" in rows[0]:
        values = [float(row["temperature_c"] or "nan") for row in rows]
        columns["temperature_c"] = np.array(values)
    return columns


def write_wav(dataset: Dataset, path: Path) -> None:
    """Write each response as a 32-bit float WAV file, and the table of poses."""
    path.mkdir(parents=True, exist_ok=True)
    known = labels(dataset)
    ends = {"emitter": dataset.emitters, "listener": dataset.listeners}
    turns = [f"{end}_{turn}" for end in ends for turn in TURNS]
    with (path / POSES).open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow([*NEEDED, *turns, *known])
        for row in range(len(dataset)):
            name = f"ir_{row:06d}.wav"
            samples = dataset.responses[row]
            write_audio(path / name, samples[None], dataset.sample_rate, "FLOAT")
            places = np.concatenate([poses.positions[row] for poses in ends.values()])
            ways = np.concatenate([poses.orientations[row] for poses in ends.values()])
            marks = [
                "" if _absent(known[key][row]) else known[key][row] for key in known
            ]
            table.writerow([name, *places.tolist(), *ways.tolist(), *marks])
    write_about(dataset, path, unit="input full scale per output full scale")


def _absent(value: object) -> bool:
    return value == -1 or value != value


FORMATS.add("wav")(
    Format(
        "folder of WAV responses and poses.csv", read_wav, write_wav, holds="poses.csv"
    )
)
