"""What every file format promises; run it on your own by its name."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from rir import Dataset, DatasetError, Poses
from rir.conformance import promise, refusal
from rir.files import FORMATS

__all__ = ["check_format", "example_path"]


def check_format(name: str) -> None:
    """Check that a format of the table gives back what was written.

    Parameters
    ----------
    name : str
        Name in the table of formats.

    Raises
    ------
    AssertionError
        If a promise is broken; names it.
    """
    kind = FORMATS[name]
    promise(kind.about, "a format says in a line what it is")
    dataset = _measured_grid()
    with TemporaryDirectory() as folder:
        path = example_path(name, Path(folder))
        kind.write(dataset, path)
        promise(kind.suits(path), f"{name} recognises what it has written")
        again = kind.read(path, None)
        refusal(DatasetError, lambda: kind.read(path, True))
    np.testing.assert_array_equal(
        again.responses[:],
        dataset.responses[:],
        "float32 samples come back",
    )
    promise(again.sample_rate == dataset.sample_rate, "the sampling rate comes back")
    promise(not again.simulated, "what was measured is still called measured")
    for ours, theirs in (
        (dataset.emitters, again.emitters),
        (dataset.listeners, again.listeners),
    ):
        np.testing.assert_allclose(
            theirs.positions, ours.positions, atol=1e-9, err_msg="places come back"
        )


def example_path(name: str, folder: Path) -> Path:
    """Return a path in a folder whose ending is the format's."""
    return folder / f"x{FORMATS[name].suffix}"


def _measured_grid() -> Dataset:
    rng = np.random.default_rng(0)
    emitters = Poses(rng.uniform(0, 3, (2, 3)))
    listeners = Poses(rng.uniform(0, 3, (3, 3)))
    samples = rng.standard_normal((2, 3, 100)).astype(np.float32).astype(float)
    return Dataset.from_arrays(
        samples, emitters, listeners, sample_rate=48000, simulated=False
    )
