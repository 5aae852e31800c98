"""One compressed NumPy file per response, as many learned fields read them."""

from pathlib import Path

import numpy as np

from rir import Dataset, DatasetError, Poses
from rir.files.table import (
    FORMATS,
    Format,
    is_simulated,
    labels,
    read_about,
    write_about,
)

__all__ = ["read_npz", "write_npz"]


def write_npz(dataset: Dataset, path: Path) -> None:
    """Write ``ir_000000.npz`` … with the response and the poses of its ends.

    Arrays: ``ir`` (n,) float32, ``position_tx``, ``position_rx`` (3,) [m],
    ``rotation_tx``, ``rotation_rx`` (4,) unit quaternion scalar last, ``fs``, and the
    labels of the row.
    """
    path.mkdir(parents=True, exist_ok=True)
    known = labels(dataset)
    for row in range(len(dataset)):
        np.savez(
            path / f"ir_{row:06d}.npz",
            ir=dataset.responses[row].astype(np.float32),
            position_tx=dataset.emitters.positions[row],
            position_rx=dataset.listeners.positions[row],
            rotation_tx=dataset.emitters.orientations[row],
            rotation_rx=dataset.listeners.orientations[row],
            fs=dataset.sample_rate,
            **{name: values[row] for name, values in known.items()},
        )
    write_about(dataset, path)


def read_npz(path: Path, simulated: bool | None) -> Dataset:
    """Read a folder written by `write_npz`.

    Raises
    ------
    DatasetError
        If there is no such file, or one lacks an array.
    """
    files = sorted(path.glob("*.npz"))
    if not files:
        raise DatasetError(f"{path} holds no .npz file")
    rows = [_read(file) for file in files]
    about = read_about(path)
    ends = []
    for end in ("tx", "rx"):
        positions = np.array([row[f"position_{end}"] for row in rows])
        turned = all(f"rotation_{end}" in row for row in rows)
        turns = [row[f"rotation_{end}"] for row in rows] if turned else np.empty((0, 4))
        ends.append(Poses(positions, np.array(turns)))
    names = [name for name in labels_in(rows[0]) if all(name in row for row in rows)]
    return Dataset.from_arrays(
        np.stack([np.asarray(row["ir"], dtype=float) for row in rows]),
        *ends,
        sample_rate=int(rows[0]["fs"]),
        simulated=is_simulated(simulated, about, path),
        room_name=", ".join(about.get("rooms", [])),
        session=path.resolve().name,
        columns={name: np.array([row[name] for row in rows]) for name in names},
    )


def labels_in(row: dict[str, np.ndarray]) -> list[str]:
    """Return the names of a row's labels."""
    arrays = {
        "ir",
        "fs",
        *(f"{k}_{e}" for k in ("position", "rotation") for e in ("tx", "rx")),
    }
    return sorted(set(row) - arrays)


def _read(file: Path) -> dict[str, np.ndarray]:
    with np.load(file, allow_pickle=False) as arrays:
        row = dict(arrays)
    missing = {"ir", "fs", "position_tx", "position_rx"} - set(row)
    if missing:
        raise DatasetError(f"{file} lacks {', '.join(sorted(missing))}")
    return row


FORMATS.add("npz")(Format("one .npz per response", read_npz, write_npz, holds="*.npz"))
