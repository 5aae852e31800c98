import numpy as np
import pytest

from fields.split import Split, split_by_emitter, split_spread
from rir import Dataset
from rir.errors import DatasetError


def places(dataset, rows):
    return {tuple(p) for p in dataset.emitters.positions[list(rows)].round(6)}


def test_grid_split_shares_no_emitter(grid):
    split = split_by_emitter(grid, test_fraction=0.25, seed=3)
    assert not places(grid, split.train) & places(grid, split.test)
    assert len(split.test) == 12
    assert sorted(split.train + split.test) == list(range(len(grid)))


def test_pair_split_keeps_both_directions_together(pairs):
    split = split_by_emitter(pairs, test_fraction=0.3, seed=1)
    pair_ids = np.asarray(pairs.table["pair_id"])
    assert split.unit == "pair"
    assert not set(pair_ids[list(split.train)]) & set(pair_ids[list(split.test)])
    assert len(split.test) == 4


def test_swapped_twins_of_test_rows_leave_the_training():
    corners = np.array([[1.0, 1, 1], [3, 1, 1], [3, 3, 1], [1, 3, 1]])
    # Every emitter place is also a listener place.
    rows = [(a, b) for a in range(4) for b in range(4) if a != b]
    dataset = Dataset.from_arrays(
        np.ones((len(rows), 4)),
        corners[[a for a, _ in rows]],
        corners[[b for _, b in rows]],
        sample_rate=8000,
    )
    split = split_by_emitter(dataset, test_fraction=0.25, seed=0)
    tested = {rows[row] for row in split.test}
    learned = {rows[row] for row in split.train}
    assert not {(b, a) for a, b in tested} & learned
    assert len(split.dropped) == 3


def test_one_emitter_is_split_by_row():
    dataset = Dataset.from_arrays(
        np.ones((1, 8, 4)), np.zeros(3), np.random.default_rng(0).random((8, 3)),
        sample_rate=8000,
    )  # fmt: skip
    split = split_by_emitter(dataset, test_fraction=0.25)
    assert split.unit == "row"
    assert len(split.test) == 2


def test_saved_split_comes_back(grid, tmp_path):
    split = split_by_emitter(grid, seed=2)
    split.save(tmp_path / "split.json")
    assert Split.load(tmp_path / "split.json", grid) == split


def test_split_of_another_data_set_is_refused(grid, pairs, tmp_path):
    split_by_emitter(grid).save(tmp_path / "split.json")
    with pytest.raises(DatasetError, match="splits 48 rows, the data set has 12"):
        Split.load(tmp_path / "split.json", pairs)


def test_fraction_outside_its_range_is_refused(grid):
    with pytest.raises(DatasetError, match="test fraction 1 is not between 0 and 1"):
        split_by_emitter(grid, test_fraction=1.0)


def test_split_of_the_data_set_itself_is_kept(grid):
    names = np.where(np.arange(len(grid)) < 36, "train", "test")
    dataset = Dataset.from_arrays(
        grid.responses[:],
        grid.emitters,
        grid.listeners,
        sample_rate=grid.sample_rate,
        columns={"split": names},
    )
    split = split_by_emitter(dataset, seed=5)
    assert split.test == tuple(range(36, 48))
    assert split.train == tuple(range(36))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "is no split file"),
        ("junk", "is no split file"),
        ("[1]", "is no split file"),
        ('{"schema": 9}', "split file of version 9"),
        ('{"schema": 1}', "'train'"),
        ('{"schema": 1, "train": ["a"], "test": [], "dropped": []}', "no split file"),
        ('{"schema": 1, "train": [0], "test": [99], "dropped": [], "rows": 48}', "99"),
        ('{"schema": 1, "train": [0], "test": [0], "dropped": [], "rows": 48}', "same"),
    ],
)
def test_files_that_are_no_split_are_told(grid, tmp_path, content, message):
    path = tmp_path / "split.json"
    if content is not None:
        path.write_text(content)
    with pytest.raises(DatasetError, match=message):
        Split.load(path, grid)


def test_spread_emitters_are_the_corners_of_a_line():
    emitters = np.array([[x, 0.0, 1.0] for x in (0.0, 1.0, 2.1, 3.0, 4.0)])
    listeners = np.array([[1.0, 3.0, 1.0], [2.0, 3.0, 1.0]])
    dataset = Dataset.from_arrays(
        np.ones((5, 2, 8)), emitters, listeners, sample_rate=8000
    )
    split = split_spread(dataset, 3)
    assert places(dataset, split.train) == {tuple(emitters[k]) for k in (0, 2, 4)}
    assert places(dataset, split.test) == {tuple(emitters[k]) for k in (1, 3)}


@pytest.mark.parametrize("count", [0, 4])
def test_spread_leaves_an_emitter_on_both_sides(grid, count):
    with pytest.raises(DatasetError, match=f"{count} emitters to train on, of 4"):
        split_spread(grid, count)
