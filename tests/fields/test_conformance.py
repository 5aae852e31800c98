"""Every field in the table keeps the same promises; no skip list."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fields import FIELDS, Field, load_field, train


@pytest.fixture(scope="module", params=list(FIELDS))
def model(request):
    return request.param


@pytest.fixture(scope="module")
def trained(model, grid):
    return train(grid, model=model, exchange=True, steps=2, seed=4)


def test_answers_queries_by_samples_in_float32(trained, grid):
    answer = trained.predict(grid.emitters, grid.listeners)
    assert answer.shape == (len(grid), grid.n_samples)
    assert answer.dtype == np.float32
    assert np.isfinite(answer).all()
    assert isinstance(trained, Field)


def test_answers_one_pose_against_many(trained, grid):
    answer = trained.predict(grid.emitters[0], grid.listeners[:3])
    assert answer.shape == (3, grid.n_samples)


def test_answers_the_same_twice(trained, grid):
    first = trained.predict(grid.emitters[:5], grid.listeners[:5])
    again = trained.predict(grid.emitters[:5], grid.listeners[:5])
    assert_array_equal(first, again)


def test_comes_back_from_its_file(trained, grid, tmp_path):
    again = load_field(trained.save(tmp_path / "field"))
    assert_allclose(
        again.predict(grid.emitters[:5], grid.listeners[:5]),
        trained.predict(grid.emitters[:5], grid.listeners[:5]),
        rtol=1e-6,
        atol=1e-7,
    )
    assert again.name == trained.name
    assert again.frame.mark == "SIMULATED"


def test_same_seed_gives_the_same_field(model, trained, grid):
    twin = train(grid, model=model, exchange=True, steps=2, seed=4)
    assert_array_equal(
        twin.predict(grid.emitters[:5], grid.listeners[:5]),
        trained.predict(grid.emitters[:5], grid.listeners[:5]),
    )


def test_coincident_ends_are_answered(trained):
    place = np.array([2.0, 2.0, 1.2])
    assert np.isfinite(trained.predict(place, place)).all()
