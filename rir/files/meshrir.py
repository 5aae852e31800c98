"""The layout of MeshRIR: every source to every microphone, as NumPy arrays."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rir import Dataset, DatasetError
from rir.files.table import FORMATS, Format, is_simulated

__all__ = ["read_meshrir", "write_meshrir"]

MILLIMETRES = 3  # decimals of a metre: finer than anybody places a microphone


def read_meshrir(path: Path, simulated: bool | None) -> Dataset:
    """Read ``pos_src.npy`` (S, 3), ``pos_mic.npy`` (M, 3) and ``ir_m.npy`` (S, n).

    The sample rate stands in ``data.json``; MeshRIR itself has 48 kHz.

    Raises
    ------
    DatasetError
        If a file is missing or of another shape.
    """
    try:
        sources = np.load(path / "pos_src.npy", allow_pickle=False)
        microphones = np.load(path / "pos_mic.npy", allow_pickle=False)
        responses = np.stack(
            [
                np.load(path / f"ir_{number}.npy", allow_pickle=False)
                for number in range(len(microphones))
            ],
            axis=1,
        )
    except (OSError, ValueError) as error:
        raise DatasetError(f"{path} is not in MeshRIR's layout: {error}") from error
    about = _about(path)
    return Dataset.from_arrays(
        responses.astype(float),
        sources,
        microphones,
        sample_rate=int(about.get("fs", 48000)),
        simulated=is_simulated(simulated, about, path),
        session=path.resolve().name,
    )


def _about(path: Path) -> dict[str, Any]:
    file = path / "data.json"
    return json.loads(file.read_text()) if file.exists() else {}


def write_meshrir(dataset: Dataset, path: Path) -> None:
    """Write a data set whose rows are all pairs of some sources and microphones.

    Raises
    ------
    DatasetError
        If a pair is missing or comes twice: the layout has no place for gaps.
    """
    sources, source_of = _distinct(dataset.emitters.positions)
    microphones, microphone_of = _distinct(dataset.listeners.positions)
    cells = np.full((len(sources), len(microphones)), -1)
    cells[source_of, microphone_of] = np.arange(len(dataset))
    if len(dataset) != cells.size or (cells < 0).any():
        raise DatasetError(
            f"{len(dataset)} responses are not each of {len(sources)} sources to each "
            f"of {len(microphones)} microphones; MeshRIR's layout needs just that: "
            "use npz or wav"
        )
    path.mkdir(parents=True, exist_ok=True)
    np.save(path / "pos_src.npy", sources)
    np.save(path / "pos_mic.npy", microphones)
    for number, rows in enumerate(cells.T):
        responses = np.asarray(dataset.responses[rows], dtype=np.float64)
        np.save(path / f"ir_{number}.npy", responses)
    about = {
        "fs": dataset.sample_rate,
        "simulated": dataset.simulated,
        "mark": dataset.mark,
        "room": dataset.room_names,
    }
    (path / "data.json").write_text(json.dumps(about, indent=1))


def _distinct(positions: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray]:
    """Return the places, first come first, and which one each row has."""
    rounded = np.round(positions, MILLIMETRES)
    _, first, which = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return positions[np.sort(first)], rank[which.ravel()]


FORMATS.add("meshrir")(
    Format(
        "MeshRIR's arrays, every source × every microphone",
        read_meshrir,
        write_meshrir,
        holds="pos_mic.npy",
    )
)
