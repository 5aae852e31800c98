"""Long rows of a clean box: paths answer to their end."""

import numpy as np
import pytest

from inverse.find import room_in_rows
from inverse.paths.long_rows import reach_row_ends
from path_rooms import level_errors


@pytest.fixture(scope="module")
def long_set(make_box_rows):
    return make_box_rows(emitters=3, listeners=12, n_samples=2400)


def test_a_clean_box_is_told_to_the_end_of_long_rows(long_set, make_box_rows):
    heard = room_in_rows(long_set)
    unseen = make_box_rows(emitters=1, listeners=6, n_samples=2400, seed=8)
    told = heard.predict(unseen.emitters, unseen.listeners, unseen.n_samples)
    assert np.median(level_errors(unseen.responses, told)) < -35
    assert heard.blend is None
    assert not heard.alarms


def test_paths_are_not_followed_where_they_tell_little(long_set, make_box_rows):
    fitted = room_in_rows(make_box_rows(emitters=3, listeners=12)).fitted
    assert fitted is not None
    rng = np.random.default_rng(2)
    noisy = long_set.responses + 0.02 * rng.standard_normal(long_set.responses.shape)
    spoiled = type(long_set)(noisy, **_others(long_set))
    assert reach_row_ends(spoiled, fitted) is fitted
    assert reach_row_ends(long_set, fitted) is not fitted


def _others(rows):
    return {name: value for name, value in vars(rows).items() if name != "responses"}
