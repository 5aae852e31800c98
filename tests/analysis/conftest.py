"""Small sessions of reciprocity pairs, made in memory."""

import numpy as np
import pytest

from rir import Dataset

RATE = 16000


def image_response(a, b, facing=None, count=4000):
    """Return a reciprocal response of a 5 x 4 x 3 m box, cardioid if facing is given.

    Images of a rigid-lossy box up to a few reflections, each rounded to a sample.
    """
    size, loss = np.array([5.0, 4.0, 3.0]), 0.8
    order = np.arange(-6, 7)
    response = np.zeros(count)
    n, m, k = np.meshgrid(order, order, order, indexing="ij")
    for flips in np.ndindex(2, 2, 2):
        sign = 1 - 2 * np.array(flips)
        cells = np.stack([n, m, k], -1).reshape(-1, 3)
        images = 2 * cells * size + sign * b
        walls = np.abs(2 * cells - flips).sum(-1)
        ray = images - a
        distance = np.linalg.norm(ray, axis=-1)
        gain = loss**walls / distance
        if facing is not None:
            gain = gain * 0.5 * (1 + ray @ facing / distance)
        delay = np.rint(distance / 343 * RATE).astype(int)
        inside = delay < count
        np.add.at(response, delay[inside], gain[inside])
    return response


def make_session(
    n_pairs=6, *, noise_db=-60.0, directional=False, seed=0, room="box", **options
):
    """Return a data set of pairs in both directions."""
    rng = np.random.default_rng(seed)
    rows, emitters, listeners, columns = [], [], [], {"pair_id": [], "direction": []}
    for pair in range(n_pairs):
        a, b = rng.uniform([0.5, 0.5, 0.5], [4.5, 3.5, 2.5], (2, 3))
        for direction, (x, y) in {"AB": (a, b), "BA": (b, a)}.items():
            facing = np.array([1.0, 0, 0]) if directional else None
            h = image_response(x, y, facing)
            h += rng.standard_normal(len(h)) * np.abs(h).max() * 10 ** (noise_db / 20)
            rows.append(h)
            emitters.append(x)
            listeners.append(y)
            columns["pair_id"].append(pair)
            columns["direction"].append(direction)
    return Dataset.from_arrays(
        np.array(rows),
        np.array(emitters),
        np.array(listeners),
        sample_rate=RATE,
        room_name=room,
        columns=columns | options.pop("columns", {}),
        **options,
    )


@pytest.fixture(scope="session")
def session():
    return make_session()


@pytest.fixture(scope="session")
def directional_session():
    return make_session(directional=True)


@pytest.fixture(scope="session")
def new_session():
    return make_session
