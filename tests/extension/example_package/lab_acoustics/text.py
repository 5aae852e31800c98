"""A format: one line of text a response, with its two places."""

from pathlib import Path

import numpy as np

from rir import Dataset, DatasetError
from rir.files import Format, is_simulated


def write_text(dataset: Dataset, path: Path) -> None:
    """Write mark and rate, then six coordinates [m] and the samples of each row."""
    ends = dataset.emitters.positions, dataset.listeners.positions
    rows = np.hstack([*ends, dataset.responses[:]])
    head = f"{dataset.mark} {dataset.sample_rate}"
    np.savetxt(path, rows, fmt="%.17g", header=head, comments="")


def read_text(path: Path, simulated: bool | None) -> Dataset:
    """Read what `write_text` wrote."""
    with path.open() as lines:
        mark, _, rate = lines.readline().partition(" ")
        if mark not in ("SIMULATED", "MEASURED"):
            raise DatasetError(f"{path} does not begin with SIMULATED or MEASURED")
        rows = np.loadtxt(lines, ndmin=2)
    return Dataset.from_arrays(
        rows[:, 6:],
        rows[:, :3],
        rows[:, 3:6],
        sample_rate=int(rate),
        simulated=is_simulated(simulated, {"simulated": mark == "SIMULATED"}, path),
    )


TEXT = Format("a line of text a response", read_text, write_text, suffix=".txt")
