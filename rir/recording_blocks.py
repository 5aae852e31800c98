"""Recording blocks of a data set: stretches of takes over which air hardly changes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray, IntArray
from rir.dataset import Dataset

__all__ = ["RecordingBlocks", "median_temperature", "recording_blocks"]

RUN_ROWS, MOST_RUNS = 16, 12
"""Takes of a session are parted into runs of so many rows at least, so many at most."""


@dataclass(frozen=True, eq=False)
class RecordingBlocks:
    """Hold when rows were recorded, and how warm it was."""

    blocks: IntArray
    """Number of each row's recording block. Shape (rows,)."""
    temperatures: FloatArray
    """Logged air temperature, degrees Celsius; NaN where nobody measured. Shape
    (rows,)."""

    def rows(self, index: NDArray) -> "RecordingBlocks":
        """Return some rows; blocks keep their numbers."""
        return RecordingBlocks(self.blocks[index], self.temperatures[index])


def recording_blocks(dataset: Dataset) -> RecordingBlocks:
    """Return the blocks of a data set.

    A session is a block. One whose rows say when they were taken, by a time or the
    number of a take, is parted into runs of takes: by their times, and in the order
    of rows where no times are known.

    Examples
    --------
    >>> import numpy as np
    >>> from rir import Dataset
    >>> plain = Dataset.from_arrays(
    ...     np.zeros((2, 3, 8)), np.ones((2, 3)), np.zeros((3, 3)), sample_rate=8000
    ... )
    >>> recording_blocks(plain).blocks.tolist()
    [0, 0, 0, 0, 0, 0]
    """
    table = dataset.table
    sessions = np.asarray(table["session"])
    times = np.asarray(table["time_utc"])
    taken = (times != "") | (np.asarray(table["take_no"]) >= 0)
    taken |= np.asarray(table["take_id"]) != ""
    blocks, count = np.zeros(len(dataset), dtype=np.int64), 0
    for session in dict.fromkeys(sessions.tolist()):
        mine = np.flatnonzero(sessions == session)
        runs = 1
        if taken[mine].all():
            runs = int(np.clip(len(mine) // RUN_ROWS, 1, MOST_RUNS))
            mine = mine[np.argsort(times[mine], kind="stable")]
        for run in np.array_split(mine, runs):
            blocks[run] = count
            count += 1
    temperatures = np.asarray(table["temperature_c"], dtype=np.float64)
    return RecordingBlocks(blocks, temperatures)


def median_temperature(dataset: Dataset) -> float:
    """Return the median of the logged temperatures, degrees Celsius; 20 if unknown."""
    if "temperature_c" not in dataset.table:
        return 20.0
    measured = np.asarray(dataset.table["temperature_c"], dtype=np.float64)
    known = measured[np.isfinite(measured)]
    return float(np.median(known)) if len(known) else 20.0
