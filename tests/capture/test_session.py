from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from capture.devices.stage import set_stage
from capture.interfaces import AudioInterface, Recording
from capture.session.dataset import build_dataset
from capture.session.engine import Session
from capture.session.folder import SessionFolder
from capture.session.journal import read_journal
from capture.session.recover import recover
from rir import Dataset, InterfaceError, SessionError, SignalError
from rir.files.audio import write_audio

MakeSession = Callable[..., Session]


def events(session: Session, kind: str) -> list[dict[str, Any]]:
    text = read_journal(session.folder.journal_path)
    return [event for event in text.events if event["event"] == kind]


class Flaky:
    """An interface that does something bad on chosen takes."""

    def __init__(self, inner: AudioInterface, faults: dict[str, Any]) -> None:
        self._inner = inner
        self._faults = faults
        self.sample_rate = inner.sample_rate
        self.n_inputs = inner.n_inputs
        self.loopback = inner.loopback
        self.simulated = True
        self.closed = False

    def play_record(
        self, signal: np.ndarray, n_samples: int, *, label: str, output: int = 0
    ) -> Recording:
        fault = self._faults.get(label)
        if isinstance(fault, BaseException):
            raise fault
        take = self._inner.play_record(signal, n_samples, label=label, output=output)
        flags = [fault] if isinstance(fault, str) else []
        return Recording(take.samples, take.sample_rate, flags, take.detail)

    def describe(self) -> dict[str, Any]:
        return self._inner.describe()

    def close(self) -> None:
        self.closed = True


def flaky(session: Session, **faults: Any) -> list[Flaky]:
    """Let a session's interface fail on chosen takes; return those opened."""
    opened: list[Flaky] = []
    inner = session.open_interface

    def open_one() -> AudioInterface:
        opened.append(Flaky(inner(), faults))
        return opened[-1]

    session.open_interface = open_one
    return opened


def test_a_session_records_every_direction_once(make_session: MakeSession) -> None:
    session = make_session(pairs=2)
    assert session.run() == []
    names = [event["take"] for event in events(session, "take_finished")]
    assert names == ["P01_AB_1", "P01_BA_1", "P02_BA_1", "P02_AB_1"]
    assert len(events(session, "moved")) == 4
    assert len(list(session.folder.raw_path.iterdir())) == 4


def test_a_noise_free_pair_is_equal_both_ways(make_session: MakeSession) -> None:
    session = make_session(pairs=2)
    session.run()
    dataset = Dataset.open(build_dataset(session.folder))
    assert dataset.simulated
    for pair in dataset.pairs():
        forward = dataset.responses[pair.forward][0]
        reverse = dataset.responses[pair.reverse][0]
        error = np.linalg.norm(forward - reverse) / np.linalg.norm(forward)
        assert error <= 1e-9


def test_a_cardioid_loudspeaker_breaks_the_pair(make_session: MakeSession) -> None:
    session = make_session(simulation={"loudspeaker": "cardioid"})
    session.run()
    dataset = Dataset.open(build_dataset(session.folder))
    [pair] = dataset.pairs()
    forward = dataset.responses[pair.forward][0]
    reverse = dataset.responses[pair.reverse][0]
    assert np.linalg.norm(forward - reverse) / np.linalg.norm(forward) > 0.05


def test_air_is_logged_per_take(make_session: MakeSession) -> None:
    session = make_session(simulation={"temperature_sigma_c": 0.2})
    session.run()
    dataset = Dataset.open(build_dataset(session.folder))
    temperatures = dataset.table["temperature_c"]
    assert np.ptp(temperatures) > 0
    np.testing.assert_allclose(
        temperatures, session.config.room.air.temperature_c, atol=1.0
    )


def test_a_driver_flag_spoils_a_take_and_it_is_made_again(
    make_session: MakeSession,
) -> None:
    session = make_session()
    flaky(session, P01_AB_1="input overflow at frame 512")
    assert session.run() == []
    first, second, *_ = events(session, "take_finished")
    assert not first["accepted"]
    assert "input overflow at frame 512" in first["reasons"][-1]
    assert (second["take"], second["accepted"]) == ("P01_AB_2", True)
    dataset = Dataset.open(build_dataset(session.folder))
    assert list(dataset.table["take_id"]) == ["P01_AB_2", "P01_BA_1"]


def test_retakes_are_bounded_and_the_session_goes_on(make_session: MakeSession) -> None:
    session = make_session(retakes=1)
    flaky(session, P01_AB_1="overflow", P01_AB_2="overflow", P01_AB_3="overflow")
    assert session.run() == ["P01_AB"]
    assert [event["key"] for event in events(session, "gave_up")] == ["P01_AB"]
    assert session.state.accepted("P01_BA")


def test_a_failing_device_is_closed_and_opened_again(make_session: MakeSession) -> None:
    session = make_session()
    opened = flaky(session, P01_AB_1=InterfaceError("the device has gone"))
    assert session.run() == []
    assert len(opened) == 2
    assert opened[0].closed
    assert events(session, "take_failed")[0]["reason"] == "the device has gone"
    assert events(session, "take_finished")[0]["take"] == "P01_AB_2"


def test_a_full_disk_stops_the_session_and_it_resumes(
    make_session: MakeSession, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = make_session()
    written: list[Path] = []

    def full(path: Path, *rest: Any) -> Path:
        if written:
            raise SignalError(f"cannot write {path}: No space left on device")
        written.append(write_audio(path, *rest))
        return written[0]

    with monkeypatch.context() as patch:
        patch.setattr("capture.session.folder.write_audio", full)
        with pytest.raises(SessionError, match="No space left.*free some space"):
            session.run()
    assert "No space left" in events(session, "stopped")[0]["reason"]
    session.record.journal.close()
    again = make_session(folder=session.folder)
    assert recover(again) == []
    assert again.run() == []
    names = [event["take"] for event in events(again, "take_finished")]
    assert names == ["P01_AB_1", "P01_BA_1"]


def test_a_device_vanishing_in_mid_take_fails_that_take_alone(
    make_session: MakeSession,
) -> None:
    fault = {"kind": "vanish", "takes": "P01_BA_1", "at_s": 0.7}
    session = make_session(simulation={"faults": [fault]})
    assert session.run() == []
    [failed] = events(session, "take_failed")
    assert failed["take"] == "P01_BA_1"
    assert "vanished 0.7 s into the take" in failed["reason"]
    assert [take.name for take in session.state.accepted("P01_BA")] == ["P01_BA_2"]


def test_a_broken_set_up_stops_the_session(make_session: MakeSession) -> None:
    fault = {"kind": "vanish", "takes": "*", "at_s": 0.7}
    session = make_session(pairs=3, retakes=0, simulation={"faults": [fault]})
    with pytest.raises(SessionError, match="3 directions in a row got no good take"):
        session.run()
    assert len(events(session, "take_failed")) == 3


def test_other_gains_in_the_second_direction_are_refused(
    make_session: MakeSession,
) -> None:
    session = make_session(gains={"preamp_db": 20.0})
    flaky(session, P01_BA_1=KeyboardInterrupt())
    with pytest.raises(KeyboardInterrupt):
        session.run()
    session.record.journal.close()
    path = session.folder.config_path
    path.write_text(path.read_text().replace("preamp_db: 20.0", "preamp_db: 26.0"))
    again = make_session(folder=session.folder)
    with pytest.raises(
        SessionError, match=r"P01_BA would be recorded with gains.*26\.0"
    ):
        again.run()


def test_closure_repeats_the_first_direction_at_the_end(
    make_session: MakeSession,
) -> None:
    session = make_session(pairs=2, closure=True)
    assert session.run() == []
    assert events(session, "take_finished")[-1]["take"] == "P01_AB-closure_1"
    [closure] = events(session, "closure_judged")
    assert closure["takes"] == ["P01_AB_1", "P01_AB-closure_1"]
    assert closure["stretch_ppm"] == 0
    assert len(Dataset.open(build_dataset(session.folder))) == 4


def test_every_pair_is_judged(make_session: MakeSession) -> None:
    session = make_session(pairs=2, simulation={"noise_db": -40.0})
    session.run()
    judged = events(session, "pair_judged")
    assert [event["pair"] for event in judged] == ["P01", "P02"]
    for event in judged:
        measured, predicted = (
            np.array(event[f"{k}_db"]) for k in ("measured", "predicted")
        )
        np.testing.assert_allclose(measured, predicted, atol=3.0)
        assert event["doubts"] == []


def test_an_interrupt_leaves_a_session_that_resumes_to_the_same_data(
    make_session: MakeSession, tmp_path: Path
) -> None:
    whole = make_session(pairs=2, folder=SessionFolder(tmp_path / "whole"))
    whole.run()
    session = make_session(pairs=2)
    opened = flaky(session, P01_BA_1=KeyboardInterrupt())
    with pytest.raises(KeyboardInterrupt):
        session.run()
    assert opened[0].closed
    assert events(session, "stopped")[0]["reason"] == "interrupted"
    session.record.journal.close()
    again = make_session(folder=session.folder)
    assert recover(again) == []
    assert again.run() == []
    one, other = (Dataset.open(build_dataset(s.folder)) for s in (whole, again))
    np.testing.assert_array_equal(one.responses[:], other.responses[:])
    np.testing.assert_array_equal(one.table["raw_sha256"], other.table["raw_sha256"])


def test_a_rebuild_gives_the_same_bytes(make_session: MakeSession) -> None:
    session = make_session(simulation={"noise_db": -50.0})
    session.run()
    first = build_dataset(session.folder).read_bytes()
    session.folder.dataset_path.unlink()
    assert build_dataset(session.folder).read_bytes() == first


def test_nothing_recorded_cannot_be_built(make_session: MakeSession) -> None:
    session = make_session()
    with pytest.raises(SessionError, match="no good take yet"):
        build_dataset(session.folder)


def damage(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(bytes(content))


@pytest.mark.parametrize("harm", [damage, Path.unlink])
def test_a_spoiled_raw_file_is_measured_again(
    make_session: MakeSession, harm: Callable[[Path], None]
) -> None:
    session = make_session()
    session.run()
    whole = build_dataset(session.folder)
    before = Dataset.open(whole).responses[:]
    session.record.journal.close()
    harm(session.folder.raw_path / "P01_BA_1.wav")
    again = make_session(folder=session.folder)
    [line] = recover(again)
    assert line.startswith("P01_BA_1 is measured again: raw/P01_BA_1.wav")
    assert again.run() == []
    np.testing.assert_array_equal(
        Dataset.open(build_dataset(again.folder)).responses[:], before
    )


def test_a_raw_file_whose_journal_line_was_edited_is_entered_again(
    make_session: MakeSession,
) -> None:
    session = make_session()
    session.run()
    session.record.journal.close()
    path = session.folder.journal_path
    lines = path.read_text().splitlines(keepends=True)
    [number] = [
        n for n, line in enumerate(lines) if '"sha256"' in line and "_AB" in line
    ]
    lines[number] = lines[number].replace('"accepted": true', '"accepted": false')
    path.write_text("".join(lines))
    again = make_session(folder=session.folder)
    told = recover(again)
    assert f"line {number + 1} was changed" in told[0]
    assert told[1].startswith("P01_AB_1 was recorded but not entered")
    assert again.run() == []
    assert len(Dataset.open(build_dataset(again.folder))) == 2


def test_a_stranger_in_the_raw_folder_is_set_aside(make_session: MakeSession) -> None:
    session = make_session()
    session.folder.write_raw("P01_AB_1", np.zeros((2, 10)), 16000)
    [line] = recover(session)
    assert "set aside" in line
    assert session.run() == []


def test_the_recovered_response_is_the_worlds_own(make_session: MakeSession) -> None:
    session = make_session()
    session.run()
    dataset = Dataset.open(build_dataset(session.folder))
    stage = set_stage(session.config)
    move = session.plan.moves[0]
    stage.mover.place(move)
    assert stage.world is not None
    world = stage.world.responses()[0]
    played = session.take_judge.signal
    heard = np.convolve(played, world)[: len(played)]
    ideal = np.stack((heard, played)).astype(np.float64)
    started = session.state.started["P01_AB_1"]
    own = session.take_judge.check(ideal, started).response[0, session.take_judge.pre :]
    error = np.linalg.norm(dataset.responses[0] - own) / np.linalg.norm(own)
    assert 20 * np.log10(error) <= -90
