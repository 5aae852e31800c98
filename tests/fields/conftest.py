import numpy as np
import pytest

from rir import Dataset, Poses

SAMPLE_RATE = 8000
N_SAMPLES = 320
SPEED = 343.2


def simple_responses(emitters, listeners, n_samples=N_SAMPLES, sample_rate=SAMPLE_RATE):
    """Direct sound and a floor reflection, each a band-limited pulse of 1/d."""
    first = np.asarray(emitters)[:, None]
    second = np.asarray(listeners)[None]
    mirrored = second * np.array([1.0, 1.0, -1.0])
    times = np.arange(n_samples) / sample_rate
    total = np.zeros((*np.broadcast_shapes(first.shape, second.shape)[:2], n_samples))
    for image, gain in ((second, 1.0), (mirrored, 0.7)):
        distance = np.linalg.norm(first - image, axis=-1)[..., None]
        delay = times - distance / SPEED
        total += gain / np.maximum(distance, 0.1) * np.sinc(sample_rate * delay)
    return total


@pytest.fixture(scope="session")
def grid():
    """Four emitters over one shared grid of twelve listeners."""
    rng = np.random.default_rng(5)
    emitters = rng.uniform([0.5, 0.5, 0.8], [4.5, 3.5, 2.0], (4, 3))
    x, y = np.meshgrid(np.linspace(0.7, 4.3, 4), np.linspace(0.7, 3.3, 3))
    listeners = np.stack([x.ravel(), y.ravel(), np.full(x.size, 1.4)], axis=1)
    return Dataset.from_arrays(
        simple_responses(emitters, listeners),
        emitters,
        listeners,
        sample_rate=SAMPLE_RATE,
    )


@pytest.fixture(scope="session")
def pairs():
    """Six reciprocity pairs, both directions of each."""
    rng = np.random.default_rng(6)
    places = rng.uniform([0.5, 0.5, 0.8], [4.5, 3.5, 2.0], (2, 6, 3))
    ends = np.stack([places[0], places[1]], axis=1).reshape(-1, 3)
    others = np.stack([places[1], places[0]], axis=1).reshape(-1, 3)
    responses = np.stack(
        [
            simple_responses(a[None], b[None])[0, 0]
            for a, b in zip(ends, others, strict=True)
        ]
    )
    return Dataset.from_arrays(
        responses,
        Poses.of(ends),
        Poses.of(others),
        sample_rate=SAMPLE_RATE,
        columns={
            "pair_id": np.repeat(np.arange(6), 2),
            "direction": np.tile(["AB", "BA"], 6),
            "accepted": np.ones(12, dtype=bool),
        },
    )
