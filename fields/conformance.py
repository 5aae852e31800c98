"""What every field promises; run it on your own model by its name."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fields.field import Field, load_field
from fields.run import train
from fields.table import FIELDS, model_config
from rir import Dataset
from rir.conformance import promise, refusal
from rir.errors import ConfigError

__all__ = ["SAMPLE_RATE", "check_field", "small_dataset", "two_path_responses"]

SAMPLE_RATE = 8000
"""Of the small data set, Hz: low, so that every model trains in seconds."""
N_SAMPLES = 320
"""Samples of its responses: 40 ms hold the floor's reflection anywhere in the room."""
SPEED = 343.2
"""Of sound at 20 degrees Celsius, m/s."""
FLOOR = 0.7
"""Amplitude that its floor reflects."""


def check_field(name: str, dataset: Dataset | None = None, *, steps: int = 2) -> None:
    """Check that a model of the table trains, answers, and comes back from its file.

    Parameters
    ----------
    name : str
        Name in the table of fields.
    dataset : Dataset, optional
        What to learn; :func:`small_dataset` by default.
    steps : int
        Training steps: the promises hold from the first on.

    Raises
    ------
    AssertionError
        If a promise is broken; names it.
    """
    data = small_dataset() if dataset is None else dataset
    _check_settings(name)
    first, second = (
        train(data, model=name, exchange=True, steps=steps, seed=4) for _ in range(2)
    )
    promise(isinstance(first, Field), f"{name} has all that fields.Field asks for")
    promise(first.name == name, f"{name} calls itself as the table does")
    _check_answers(first, data)
    few = data.emitters[:5], data.listeners[:5]
    np.testing.assert_array_equal(
        second.predict(*few), first.predict(*few), "one seed gives one field"
    )
    with TemporaryDirectory() as folder:
        again = load_field(first.save(Path(folder) / "field"))
    np.testing.assert_allclose(
        again.predict(*few),
        first.predict(*few),
        rtol=1e-6,
        atol=1e-7,
        err_msg="a stored field answers as before",
    )
    promise(again.name == name, "a stored field knows its model")
    promise(again.frame.mark == data.mark, "a stored field knows SIMULATED or MEASURED")


def _check_settings(name: str) -> None:
    promise("cpu" in FIELDS[name].load_module().PRESETS, f"{name} has a preset cpu")
    told = refusal(ConfigError, lambda: model_config(name, {"no such": 1}))
    promise(f"{name} has no such setting" in told, f"{name} names an unknown setting")


def _check_answers(field: Field, data: Dataset) -> None:
    answer = field.predict(data.emitters, data.listeners)
    promise(answer.shape == (len(data), data.n_samples), "one response a query")
    promise(answer.dtype == np.float32, "responses are float32")
    promise(np.isfinite(answer).all(), "responses are finite")
    one = field.predict(data.emitters[0], data.listeners[:3])
    promise(one.shape == (3, data.n_samples), "one pose meets many")
    few = data.emitters[:5], data.listeners[:5]
    np.testing.assert_array_equal(
        field.predict(*few), field.predict(*few), "asked twice, it answers the same"
    )
    place = np.array([2.0, 2.0, 1.2])
    promise(np.isfinite(field.predict(place, place)).all(), "ends may coincide")


def small_dataset() -> Dataset:
    """Return four emitters over one grid of twelve listeners, SIMULATED.

    Examples
    --------
    >>> len(small_dataset())
    48
    """
    rng = np.random.default_rng(5)
    emitters = rng.uniform([0.5, 0.5, 0.8], [4.5, 3.5, 2.0], (4, 3))
    x, y = np.meshgrid(np.linspace(0.7, 4.3, 4), np.linspace(0.7, 3.3, 3))
    listeners = np.stack([x.ravel(), y.ravel(), np.full(x.size, 1.4)], axis=1)
    responses = two_path_responses(emitters, listeners)
    return Dataset.from_arrays(responses, emitters, listeners, sample_rate=SAMPLE_RATE)


def two_path_responses(
    emitters: ArrayLike, listeners: ArrayLike, n_samples: int = N_SAMPLES
) -> NDArray[np.float64]:
    """Return direct sound and floor reflection, band-limited pulses of 1/distance.

    Parameters
    ----------
    emitters, listeners : array_like, shape (n, 3) and (m, 3)
        Places above the floor z = 0, metres.
    n_samples : int
        Length.

    Returns
    -------
    ndarray, shape (n, m, n_samples)
        At :data:`SAMPLE_RATE`.
    """
    first = np.asarray(emitters)[:, None]
    second = np.asarray(listeners)[None]
    mirrored = second * np.array([1.0, 1.0, -1.0])
    times = np.arange(n_samples) / SAMPLE_RATE
    total = np.zeros((first.shape[0], second.shape[1], n_samples))
    for image, gain in ((second, 1.0), (mirrored, FLOOR)):
        distance = np.linalg.norm(first - image, axis=-1)[..., None]
        delay = times - distance / SPEED
        total += gain / np.maximum(distance, 0.1) * np.sinc(SAMPLE_RATE * delay)
    return total
