import io
import json
import os
import resource
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from capture.commands.capture_pairs import main
from rir import Dataset
from rir.config import parse_yaml

TINY = """
sample_rate: 16000
response_s: 0.2
sweep: {seconds: 1.0, band_hz: [60, 7000], tail_s: 0.4, noise_s: 0.3}
"""

BOOTH = """
name: booth
size_m: [4.2, 3.4, 2.5]
surfaces: {all: {absorption: 0.7}}
"""


@pytest.fixture
def tiny(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return options of a small session; the working directory is a new one."""
    monkeypatch.chdir(tmp_path)
    Path("tiny.yaml").write_text(TINY)
    Path("booth.yaml").write_text(BOOTH)
    return ["--room", "booth.yaml", "--pairs", "2", "--config", "tiny.yaml", "--plain"]


def test_one_command_makes_a_data_set(
    tiny: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*tiny, "--out", "k", "--noise-db", "-60"]) == 0
    told = capsys.readouterr().out
    assert "SIMULATED: no sound is played, no microphone is heard" in told
    assert "SIMULATED data set written: k/dataset.h5" in told
    assert "left" in told
    dataset = Dataset.open("k")
    assert len(dataset) == 4
    assert dataset.simulated
    assert dataset.room_names == ["booth"]
    assert len(dataset.pairs()) == 2
    first = json.loads(Path("k/journal.jsonl").read_text().splitlines()[0])
    assert first["about"]["mark"] == "SIMULATED"


def test_a_finished_session_is_left_alone(
    tiny: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*tiny, "--out", "k"]) == 0
    before = Path("k/dataset.h5").read_bytes()
    assert main([*tiny, "--out", "k"]) == 0
    assert "complete already" in capsys.readouterr().out
    assert Path("k/dataset.h5").read_bytes() == before
    assert main([*tiny, "--out", "k", "--new"]) == 1
    assert "holds a session" in capsys.readouterr().err


def test_rebuild_gives_the_same_bytes(tiny: list[str]) -> None:
    assert main([*tiny, "--out", "k"]) == 0
    before = Path("k/dataset.h5").read_bytes()
    Path("k/dataset.h5").unlink()
    assert main(["--rebuild", "k"]) == 0
    assert Path("k/dataset.h5").read_bytes() == before


def test_a_dry_run_prints_the_plan_and_writes_nothing(
    tiny: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*tiny, "--dry-run"]) == 0
    told = capsys.readouterr().out
    assert "move loudspeaker to P01A" in told
    assert "measure P02_AB, 1 take" in told
    assert "2 pairs, 4 takes of 1.7 s" in told
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["booth.yaml", "tiny.yaml"]


def test_an_interrupted_session_is_resumed_by_the_same_command(
    tiny: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    from capture.interfaces.simulated import SimulatedInterface

    whole = SimulatedInterface.play_record

    def interrupted(self: SimulatedInterface, *signal: Any, label: str, **more: Any):
        if label == "P02_BA_1":
            raise KeyboardInterrupt
        return whole(self, *signal, label=label, **more)

    with monkeypatch.context() as patch:
        patch.setattr(SimulatedInterface, "play_record", interrupted)
        assert main(tiny) == 130
    [folder] = Path("sessions").iterdir()
    assert not (folder / "dataset.h5").exists()
    capsys.readouterr()
    assert main(tiny) == 0
    assert "resuming: 2 of 4 directions are done" in capsys.readouterr().out
    assert [path.name for path in Path("sessions").iterdir()] == [folder.name]
    assert len(Dataset.open(folder)) == 4
    assert main(tiny) == 0
    assert len(list(Path("sessions").iterdir())) == 2


@pytest.mark.parametrize(
    ("options", "code", "message"),
    [
        (["--room", "kitchn"], 1, "known: kitchen, conference, office"),
        ([], 2, "give --room"),
        (["--room", "kitchen", "--pairs", "none.yaml"], 1, "none.yaml"),
        (["--room", "kitchen", "--takes", "0"], 2, "takes"),
        (["--room", "kitchen", "--apart", "50"], 1, "found 0 of 20 pairs"),
        (["--rebuild", "nowhere"], 1, "no session folder"),
        (["--rom", "kitchen"], 2, "--rom"),
    ],
)
def test_mistakes_end_in_one_line(
    options: list[str],
    code: int,
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(options) == code
    assert message in capsys.readouterr().err


def test_checked_settings_start_a_session(
    tiny: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*tiny, "--check"]) == 0
    assert "settings locked in checked.yaml" in capsys.readouterr().out
    level = parse_yaml(Path("checked.yaml").read_text())["sweep"]["amplitude_dbfs"]
    options = ["--room", "booth.yaml", "--pairs", "1", "--config", "checked.yaml"]
    assert main([*options, "--sweep-seconds", "1", "--out", "k"]) == 0
    session = parse_yaml(Path("k/session.yaml").read_text())
    assert session["sweep"]["amplitude_dbfs"] == level


def test_a_measured_room_is_played_back(tiny: list[str]) -> None:
    assert main([*tiny, "--out", "first"]) == 0
    options = [*tiny, "--out", "second", "--measured", "first/dataset.h5"]
    assert main(options) == 0
    spectra = []
    for name in ("first", "second"):
        responses = Dataset.open(name).responses[:]
        spectra.append(np.fft.rfft(responses, 2 * responses.shape[1]))
    # The second pass through the band's slopes shows only outside the band.
    frequencies = np.linspace(0, 8000, spectra[0].shape[1])
    inside = (frequencies > 200) & (frequencies < 6500)
    one, other = (spectrum[:, inside] for spectrum in spectra)
    assert np.linalg.norm(one - other) / np.linalg.norm(one) < 0.01


def test_a_rig_that_loses_its_supply_is_homed_only_with_consent(
    tiny: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    pytest.importorskip("pty")
    options = [*tiny, "--pairs", "5", "--rig", "kitchen-simulated", "--out", "k"]
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    assert main(options) == 1
    assert "nobody is there to answer" in capsys.readouterr().err
    assert main([*options, "--yes"]) == 0
    assert "the controller restarted by itself" in capsys.readouterr().out
    assert len(Dataset.open("k")) == 10


def test_help_costs_little() -> None:
    def cpu(*arguments: str) -> float:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(
            [sys.executable, *arguments],
            check=True,
            capture_output=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    code = (
        "from capture.commands.capture_pairs import main;"
        " raise SystemExit(main(['--help']))"
    )
    bare = min(cpu("-c", "pass") for _ in range(3))
    helped = min(cpu("-c", code) for _ in range(3))
    assert helped - bare <= 0.3


def test_a_damaged_raw_file_of_a_finished_session_is_measured_again(
    tiny: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*tiny, "--out", "k"]) == 0
    first = sorted(Path("k/raw").iterdir())[0]
    first.write_bytes(b"not what was recorded")
    Path("k/dataset.h5").unlink()
    assert main([*tiny, "--out", "k"]) == 0
    told = capsys.readouterr().out
    assert f"{first.stem} is measured again" in told
    assert len(Dataset.open("k")) == 4
    assert len(list(Path("k/set_aside").iterdir())) == 1


def test_a_write_cut_short_is_told_in_one_line(
    tiny: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import soundfile

    def cut_short(*_: object, **__: object) -> None:
        raise AssertionError

    monkeypatch.setattr(soundfile, "write", cut_short)
    assert main([*tiny, "--out", "k"]) == 1
    error = capsys.readouterr().err
    assert "is the disk full?; free some space and run again" in error
    assert list(Path("k/raw").iterdir()) == []
