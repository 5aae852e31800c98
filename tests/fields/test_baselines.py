import numpy as np
import pytest
from numpy.testing import assert_allclose

from fields import train
from fields.exchange import swapped_ends
from rir import Dataset, Poses
from rir.errors import TrainingError


def test_nearest_answers_its_own_rows_exactly(grid):
    field = train(grid, model="nearest")
    answers = field.predict(grid.emitters, grid.listeners)
    assert_allclose(answers, grid.responses[:], atol=1e-6)


def test_exchange_lets_nearest_answer_the_swapped_query(grid):
    field = train(grid, model="nearest", exchange=True)
    answers = field.predict(grid.listeners, grid.emitters)
    assert_allclose(answers, grid.responses[:], atol=1e-6)


def test_linear_is_exact_for_responses_linear_in_position():
    x, y = np.meshgrid(np.arange(4.0), np.arange(3.0))
    listeners = np.stack([x.ravel(), y.ravel(), np.ones(12)], axis=1)
    responses = np.stack([listeners[:, 0], listeners[:, 1], np.ones(12)], axis=1)
    dataset = Dataset.from_arrays(
        responses, np.zeros((12, 3)), listeners, sample_rate=8000
    )
    field = train(dataset, model="linear")
    asked = np.array([[0.3, 0.6, 1.0], [2.2, 1.9, 1.0]])
    expected = np.column_stack([asked[:, :2], np.ones(2)])
    assert_allclose(field.predict(np.zeros(3), asked), expected, atol=1e-5)


def test_linear_weights_by_inverse_distance_where_nothing_encloses():
    dataset = Dataset.from_arrays(
        np.array([[1.0], [2.0]]), np.zeros((2, 3)), np.array([[1.0, 0, 0], [3, 0, 0]]),
        sample_rate=8000,
    )  # fmt: skip
    field = train(dataset, model="linear")
    # 0.5 m from the first and 1.5 m from the second: weights 3/4 and 1/4.
    answer = field.predict(np.zeros(3), np.array([1.5, 0, 0]))
    assert_allclose(answer, [[1.25]], rtol=1e-6)


@pytest.mark.parametrize("model", ["nearest", "linear"])
def test_one_row_is_enough(model):
    dataset = Dataset.from_arrays(
        np.arange(8.0)[None], np.zeros((1, 3)), np.zeros((1, 3)), sample_rate=8000
    )
    answer = train(dataset, model=model).predict(np.ones(3), np.ones(3))
    assert_allclose(answer, [np.arange(8.0)], rtol=1e-6)


def test_position_exchange_leaves_orientations_with_their_device():
    emitters = Poses.of(np.zeros((1, 3)))
    listeners = Poses(np.ones((1, 3)), np.array([[0.0, 0, 1, 0]]))
    first, second = swapped_ends(emitters, listeners, "position")
    assert_allclose(first.positions, 1.0)
    assert_allclose(first.orientations, emitters.orientations)
    assert_allclose(second.orientations, listeners.orientations)


def test_unknown_exchange_mode_is_refused(grid):
    with pytest.raises(TrainingError, match="known: pose, position"):
        swapped_ends(grid.emitters, grid.listeners, "both")


def test_queries_of_unequal_number_are_refused(grid):
    field = train(grid, model="nearest")
    with pytest.raises(TrainingError, match="2 emitters against 3 listeners"):
        field.predict(np.zeros((2, 3)), np.zeros((3, 3)))
