import pickle
from pathlib import Path

import h5py
import numpy as np
import pytest

from rir import Dataset, DatasetError, DatasetWriter, GainPattern, RoomSpec

ROOM = RoomSpec(name="cell", size_m=(3, 3, 3), surfaces={"all": {"absorption": 0.5}})  # pyright: ignore[reportArgumentType]
A, B = np.array([1.0, 1.0, 1.0]), np.array([2.0, 2.0, 1.0])


def write_session(path: Path, *, rate: int = 8000, shift: float = 0.0) -> Path:
    with DatasetWriter(
        path,
        sample_rate=rate,
        n_samples=8,
        pre=2,
        simulated=True,
        dtype="float64",
        room=ROOM,
        metadata={"operator": "Ana"},
        extras={"excitation": np.arange(3.0)},
        emitter_gain=GainPattern.cardioid(),
    ) as writer:
        for pair in range(3):
            block = shift + 100 * pair + np.arange(20.0).reshape(2, 10)
            columns = {
                "pair_id": pair,
                "direction": ["AB", "BA"],
                "take_id": [f"{pair:03d}-AB-1", f"{pair:03d}-BA-1"],
            }
            columns |= {"temperature_c": 20.5} if pair == 2 else {}
            writer.append(block, np.stack([A, B]), np.stack([B, A]), columns)
    return path


def test_rows_come_back_from_the_emission_on(tmp_path: Path) -> None:
    ds = Dataset.open(write_session(tmp_path / "one.h5"))
    assert (len(ds), ds.n_samples, ds.pre, ds.sample_rate) == (6, 8, 2, 8000)
    np.testing.assert_array_equal(ds.responses[1], np.arange(12.0, 20.0))
    np.testing.assert_array_equal(ds.responses[[5, 0, 5]][:, 0], [212, 2, 212])
    np.testing.assert_array_equal(ds.read([0], with_pre=True)[0], np.arange(10.0))
    assert ds.mark == "SIMULATED"
    assert ds.rooms == [ROOM]
    assert ds.sessions[0]["operator"] == "Ana"
    assert ds.emitter_gain == GainPattern.cardioid()
    assert ds.listener_gain is None
    np.testing.assert_array_equal(ds.extras[0]["excitation"], [0, 1, 2])


def test_what_is_absent_is_never_zero(tmp_path: Path) -> None:
    table = Dataset.open(write_session(tmp_path / "one.h5")).table
    np.testing.assert_array_equal(table["temperature_c"], [np.nan] * 4 + [20.5] * 2)
    assert np.isnan(table["humidity_percent"]).all()
    assert (table["take_no"] == -1).all()
    assert (table["raw_file"] == "").all()


def test_several_sessions_read_as_one(tmp_path: Path) -> None:
    first = write_session(tmp_path / "one.h5")
    second = write_session(tmp_path / "two.h5", shift=1000.0)
    ds = Dataset.open(first, second)
    np.testing.assert_array_equal(ds.responses[[7, 0]][:, 0], [1012, 2])
    assert [(p.session, p.pair_id) for p in ds.pairs()][2:4] == [("one", 2), ("two", 0)]
    chosen = ds.subset(ds.table["session"] == "two")
    np.testing.assert_array_equal(chosen.responses[0], ds.responses[6])
    assert len(chosen.pairs()) == 3


def test_pairs_hold_both_directions(tmp_path: Path) -> None:
    ds = Dataset.open(write_session(tmp_path / "one.h5"))
    record = ds.pair_record(ds.pairs()[1])
    assert record.distance == pytest.approx(np.sqrt(2))
    np.testing.assert_array_equal(record.forward.emitter.position, A)
    lonely = ds.subset([0, 2, 3])
    with pytest.raises(DatasetError, match="pair 0 of one lacks a direction"):
        lonely.pair_record(lonely.pairs()[0])


def test_the_same_rows_give_the_same_bytes(tmp_path: Path) -> None:
    for folder in "ab":
        (tmp_path / folder).mkdir()
        write_session(tmp_path / folder / "one.h5")
    first, second = ((tmp_path / f / "one.h5").read_bytes() for f in "ab")
    assert first == second


def test_a_failed_writer_leaves_nothing(tmp_path: Path) -> None:
    path = tmp_path / "bad.h5"
    with (
        pytest.raises(DatasetError, match="NaN or infinity"),
        DatasetWriter(path, sample_rate=8000, n_samples=4, simulated=True) as writer,
    ):
        writer.append(np.full((1, 4), np.nan), A, B)
    assert list(tmp_path.iterdir()) == []


def test_reads_survive_a_worker_process(tmp_path: Path) -> None:
    ds = Dataset.open(write_session(tmp_path / "one.h5"))
    copy = pickle.loads(pickle.dumps(ds))
    np.testing.assert_array_equal(copy.responses[3], ds.responses[3])


def test_arrays_of_emitters_times_listeners() -> None:
    responses = np.arange(24.0).reshape(2, 3, 4)
    ds = Dataset.from_arrays(
        responses, np.eye(2, 3), np.ones((3, 3)), sample_rate=16000
    )
    np.testing.assert_array_equal(ds.responses[4], responses[1, 1])
    np.testing.assert_array_equal(ds.table["emitter_id"], [0, 0, 0, 1, 1, 1])
    np.testing.assert_array_equal(ds.emitters.positions[3], [0, 1, 0])
    with pytest.raises(DatasetError, match="do not fit 1 emitters × 3 listeners"):
        Dataset.from_arrays(responses, A, np.ones((3, 3)), sample_rate=16000)


def test_a_saved_subset_is_the_same_data(tmp_path: Path) -> None:
    ds = Dataset.open(write_session(tmp_path / "one.h5")).subset([3, 1])
    copy = Dataset.open(ds.save(tmp_path / "copy.h5"))
    np.testing.assert_array_equal(copy.responses[:], ds.responses[:])
    np.testing.assert_array_equal(copy.table["take_id"], ds.table["take_id"])
    assert (copy.pre, copy.rooms, copy.emitter_gain) == (2, [ROOM], ds.emitter_gain)


def test_files_that_cannot_be_read_say_why(tmp_path: Path) -> None:
    newer = write_session(tmp_path / "newer.h5")
    with h5py.File(newer, "a") as file:
        file.attrs["schema"] = 99
    broken = tmp_path / "broken.h5"
    broken.write_bytes(write_session(tmp_path / "x.h5").read_bytes()[:1000])
    session = tmp_path / "session"
    session.mkdir()
    (session / "journal.jsonl").touch()
    cases = {
        newer: "of version 99; this program reads up to 1: update it",
        broken: "cannot be read as HDF5",
        session: "is a session without dataset.h5",
        tmp_path / "nowhere.h5": "does not exist",
        tmp_path: "holds no dataset.h5",
    }
    for path, message in cases.items():
        with pytest.raises(DatasetError, match=message):
            Dataset.open(path)


def test_sample_rates_are_not_mixed(tmp_path: Path) -> None:
    first = write_session(tmp_path / "one.h5")
    second = write_session(tmp_path / "two.h5", rate=16000)
    with pytest.raises(DatasetError, match=r"differ in sample rate \(8000, 16000 Hz\)"):
        Dataset.open(first, second)


def test_a_large_set_is_read_by_rows(tmp_path: Path) -> None:
    path = tmp_path / "large.h5"
    with DatasetWriter(path, sample_rate=8000, n_samples=64, simulated=True) as writer:
        for start in range(0, 20000, 1000):
            block = np.repeat(np.arange(start, start + 1000.0)[:, None], 64, axis=1)
            writer.append(block, A, B)
    ds = Dataset.open(path)
    rows = np.random.default_rng(0).permutation(len(ds))[:300]
    np.testing.assert_array_equal(ds.responses[rows][:, 5], rows)
    assert ds.responses[10:12].dtype == np.float32
