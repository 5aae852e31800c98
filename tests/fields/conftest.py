import numpy as np
import pytest

from fields.conformance import SAMPLE_RATE, small_dataset, two_path_responses
from rir import Dataset, Poses


@pytest.fixture(scope="session")
def grid():
    """Four emitters over one shared grid of twelve listeners."""
    return small_dataset()


@pytest.fixture(scope="session")
def pairs():
    """Six reciprocity pairs, both directions of each."""
    rng = np.random.default_rng(6)
    places = rng.uniform([0.5, 0.5, 0.8], [4.5, 3.5, 2.0], (2, 6, 3))
    ends = np.stack([places[0], places[1]], axis=1).reshape(-1, 3)
    others = np.stack([places[1], places[0]], axis=1).reshape(-1, 3)
    responses = np.stack(
        [
            two_path_responses(a[None], b[None])[0, 0]
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
