import json
import os
from pathlib import Path

import numpy as np
import pytest

from capture.session.journal import Journal, decode, encode, plain, read_journal
from rir import SessionError


def test_events_come_back_in_order(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    with Journal(path) as journal:
        for number in range(3):
            journal.write({"event": "e", "number": number, "t": float("nan")})
    text = read_journal(path)
    assert [event["number"] for event in text.events] == [0, 1, 2]
    assert text.events[0]["t"] is None
    assert text.complaints() == []


@pytest.mark.parametrize("cut", [1, 2, 10, 40])
def test_torn_last_line_is_told_and_dropped(tmp_path: Path, cut: int) -> None:
    path = tmp_path / "journal.jsonl"
    path.write_bytes(encode({"event": "a"}) + encode({"event": "b" * 40})[:-cut])
    with Journal(path) as journal:
        assert [event["event"] for event in journal] == ["a"]
        assert "torn" in journal.text.complaints()[0]
        journal.write({"event": "c"})
    assert [event["event"] for event in read_journal(path).events] == ["a", "c"]


def test_edited_line_is_told_by_number_and_ignored(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    with Journal(path) as journal:
        for name in "abc":
            journal.write({"event": name, "accepted": False})
    lines = path.read_text().splitlines()
    lines[1] = lines[1].replace("false", "true")
    path.write_text("\n".join(lines) + "\n")
    text = read_journal(path)
    assert [event["event"] for event in text.events] == ["a", "c"]
    assert text.changed == [2]
    assert "line 2 was changed" in text.complaints()[0]


def test_two_writers_are_refused(tmp_path: Path) -> None:
    pytest.importorskip("fcntl")
    path = tmp_path / "journal.jsonl"
    with Journal(path), pytest.raises(SessionError, match="another program"):
        Journal(path)


def test_a_full_disk_leaves_whole_lines(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "journal.jsonl"
    with Journal(path) as journal:
        journal.write({"event": "a"})

        def full(descriptor: int) -> None:
            del descriptor
            raise OSError(28, "No space left on device")

        with monkeypatch.context() as patch:
            patch.setattr(os, "fsync", full)
            with pytest.raises(SessionError, match="No space left"):
                journal.write({"event": "b"})
        journal.write({"event": "c"})
    assert [event["event"] for event in read_journal(path).events] == ["a", "c"]


@pytest.mark.parametrize("line", [b"", b"[]", b"{", b'{"event": "a"}', b"\xff\xfe"])
def test_what_is_no_event_decodes_to_none(line: bytes) -> None:
    assert decode(line) is None


def test_arrays_and_numpy_scalars_become_plain() -> None:
    value = plain({"a": np.array([1.0, np.inf]), "b": np.float64(2), "c": np.int64(3)})
    assert json.dumps(value) == '{"a": [1.0, null], "b": 2.0, "c": 3}'
